"""Edits: what was compiled is taken over, and the bits are those of a scene that was made so from the start."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import SCENES

import steradian as sr

SMALL = {"resolution": (24, 16), "integrator": "path", "spp": 2, "progress": False}


def textured(folder: Path) -> sr.Scene:
    """A mesh with an image on it, an instance, a lamp."""
    made = sr.render(SCENES / "small-lamp.pbrt", resolution=(8, 8), spp=4, integrator="path", progress=False)
    made.save(folder / "a.png")
    square = np.array([[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], np.float32)
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    image = sr.ImageMapTexture(folder / "a.png")
    return sr.Scene(
        camera=sr.PerspectiveCamera(40, world_from_camera=sr.look_at((0, -6, 2), (0, 0, 0.7))),
        film={"resolution": (24, 16)},
        materials={"floor": sr.DiffuseMaterial(image), "ball": sr.DiffuseMaterial((0.7, 0.1, 0.1))},
        shapes=[
            sr.Mesh(square, uvs=uv, indices=[[0, 1, 2], [0, 2, 3]], material="floor"),
            sr.Sphere(1.0, material="ball", world_from_object=sr.translate(0, 0, 1)),
            sr.Sphere(0.2, area_light=30.0, world_from_object=sr.translate(2, -1, 3)),
        ],
        lights=[sr.InfiniteConstantLight((0.1, 0.12, 0.15))],
    )


def colour(scene: sr.Scene) -> None:
    scene.materials["ball"] = sr.DiffuseMaterial((0.1, 0.1, 0.7))


def camera(scene: sr.Scene) -> None:
    scene.camera = scene.camera.replace(fov=55.0)


def light(scene: sr.Scene) -> None:
    scene.lights[0] = sr.InfiniteConstantLight((0.5, 0.3, 0.1))


def lamp_shape(scene: sr.Scene) -> None:
    scene.shapes[2] = scene.shapes[2].replace(area_light=60.0)


def cut_out(scene: sr.Scene) -> None:
    scene.shapes[1] = scene.shapes[1].replace(alpha=0.5)


def place(scene: sr.Scene) -> None:
    scene.shapes[1] = scene.shapes[1].replace(world_from_object=sr.translate(0.5, 0, 1))


def take_away(scene: sr.Scene) -> None:
    del scene.shapes[1]


def no_image(scene: sr.Scene) -> None:
    scene.materials["floor"] = sr.DiffuseMaterial(0.5)


EDITS = [colour, camera, light, lamp_shape, cut_out, place, no_image, take_away]


@pytest.mark.parametrize("edit", EDITS)
def test_an_edited_scene_renders_as_one_made_so(edit: Callable[[sr.Scene], None], tmp_path: Path) -> None:
    scene, other = textured(tmp_path), textured(tmp_path)
    before = sr.render(scene, **SMALL)
    edit(scene)
    edit(other)
    after = sr.render(scene, **SMALL)
    assert after.to_bytes() == sr.render(other, **SMALL).to_bytes()
    assert after.to_bytes() != before.to_bytes() and scene.content_hash == other.content_hash


def test_edits_follow_each_other_and_films_know_their_scene(tmp_path: Path) -> None:
    scene, other = textured(tmp_path), textured(tmp_path)
    first = sr.render(scene, **SMALL)
    for edit in EDITS:
        edit(scene)
        sr.render(scene, **{**SMALL, "resolution": (12, 8)})
        edit(other)
    assert sr.render(scene, **SMALL).to_bytes() == sr.render(other, **SMALL).to_bytes()
    with pytest.raises(sr.ResumeError, match="scenes"):
        sr.resume(first, more=1, progress=False)


def test_images_are_not_read_again(tmp_path: Path) -> None:
    scene = textured(tmp_path)
    sr.render(scene, **SMALL)
    (tmp_path / "a.png").unlink()
    camera(scene)
    assert np.isfinite(sr.render(scene, **SMALL).array).all()


def test_a_running_render_keeps_its_scene(tmp_path: Path) -> None:
    scene = textured(tmp_path)
    expected = sr.render(scene, **SMALL).array
    live = sr.live(scene, resolution=(24, 16), integrator="path", time=60)
    while live.image is None:
        pass
    colour(scene)
    blue = sr.render(scene, **SMALL).array
    live.stop()
    seen = live.wait(60)
    ball = np.s_[6:9, 11:13]
    assert seen.array[ball].mean((0, 1)).argmax() == expected[ball].mean((0, 1)).argmax() == 0
    assert blue[ball].mean((0, 1)).argmax() == 2


def test_an_edit_that_is_refused_costs_no_scene(tmp_path: Path) -> None:
    scene = textured(tmp_path)
    sr.render(scene, **SMALL)
    good = scene.camera
    scene.camera = good.replace(fov=500.0)
    with pytest.raises(sr.SceneError, match="this camera has no meaning"):
        sr.render(scene, **SMALL)
    scene.camera = good
    assert sr.render(scene, **SMALL).to_bytes() == sr.render(textured(tmp_path), **SMALL).to_bytes()
