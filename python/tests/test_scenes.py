"""Scenes from Python: every kind, every short form, edits, and what is refused."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ROOT, SCENES

import steradian as sr
from steradian import _generate, _schema
from steradian.kinds import CLASSES

TINY = {"spp": 2, "resolution": (8, 8)}
QUAD = np.array([[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]])


def room(**more: Any) -> sr.Scene:
    """A floor, a ball, a sky."""
    content: dict[str, Any] = {
        "camera": sr.PerspectiveCamera(50, world_from_camera=sr.look_at((0, -5, 2), (0, 0, 0.5))),
        "film": {"resolution": (16, 16)},
        "materials": {"red": sr.DiffuseMaterial((0.7, 0.1, 0.1))},
        "shapes": [
            sr.Mesh(QUAD, indices=[[0, 1, 2], [0, 2, 3]]),
            sr.Sphere(1.0, material="red", world_from_object=sr.translate(0, 0, 1)),
        ],
        "lights": [sr.InfiniteConstantLight(1.0)],
    }
    return sr.Scene({**content, **more})


def test_the_dataclasses_are_those_of_the_schema() -> None:
    written = (ROOT / "python/steradian/kinds.py").read_text()
    assert written == _generate.generate(), "scene-desc has changed: run `cargo xtask kinds`"


def needed(made: type) -> dict[str, Any]:
    """Values for what a class has no default for."""
    values: dict[str, Any] = {
        "positions": np.zeros((3, 3)) if made is not sr.BilinearMesh else np.zeros((4, 3)),
        "segments": np.zeros((1, 4, 3)),
        "image": str(SCENES.parent / "none.png"),
        "front": 0,
    }
    fields = [f for f in dataclasses.fields(made) if f.default is f.default_factory is dataclasses.MISSING]
    return {f.name: values[f.name] for f in fields if f.name in values} if all(
        f.name in values for f in fields
    ) else {}


@pytest.mark.parametrize("family", sorted(_schema.FAMILIES))
def test_every_kind_can_be_said(family: str) -> None:
    scene = room()
    said = 0
    for (of, kind), made in CLASSES.items():
        if of != family:
            continue
        try:
            thing = made(**needed(made))
        except TypeError:
            continue  # It has values that a table of kinds cannot know.
        if family == "CameraDesc":
            scene.camera = thing
            again = scene.camera
        else:
            sections = {"LightDesc": scene.lights, "MaterialDesc": scene.materials, "MediumDesc": scene.media}
            listing = sections.get(family, scene.textures if family == "TextureDesc" else scene.shapes)
            again = listing[listing.append(thing)]
        assert type(again) is made
        said += 1
    # Grids of media have no defaults.
    expected = 1 if family == "MediumDesc" else len(_schema.flat(family)) * 2 // 3
    assert said >= expected, f"{said} of {len(_schema.flat(family))}"


def test_what_is_read_is_what_was_written() -> None:
    scene = room()
    before = scene.content_hash
    for listing in (scene.materials, scene.lights, scene.shapes):
        for i in range(len(listing)):
            listing[i] = listing[i]
    for name in ("camera", "film", "filter", "sampler", "integrator"):
        setattr(scene, name, getattr(scene, name))
    assert scene.content_hash == before
    assert scene.materials["red"].reflectance == pytest.approx((0.7, 0.1, 0.1))
    assert (scene.shapes[0].positions == QUAD).all()


def test_dicts_say_the_same_as_dataclasses() -> None:
    one = room(shapes=[sr.Sphere(2.0, material="red", z_min=0.0)])
    two = room(shapes=[{"type": "sphere", "radius": 2.0, "material": "red", "z_min": 0.0}])
    assert one.content_hash == two.content_hash


def test_edits_are_seen_and_nothing_else_changes() -> None:
    scene = room()
    red = sr.render(scene, spp=4)
    scene.materials["red"] = scene.materials["red"].replace(reflectance=(0.1, 0.1, 0.7))
    blue = sr.render(scene, spp=4)
    assert (red.array[8, 8, 0] > red.array[8, 8, 2]) and (blue.array[8, 8, 0] < blue.array[8, 8, 2])
    with pytest.raises(sr.ResumeError, match="scenes"):
        sr.resume(red, more=1)

    # Back to what it was: the same scene, the same bits.
    scene.materials["red"] = sr.DiffuseMaterial((0.7, 0.1, 0.1), name="red")
    assert sr.render(scene, spp=4).to_bytes() == red.to_bytes()

    scene.lights[0] = scene.lights[0].replace(radiance=2.0)
    assert sr.render(scene, spp=4).array.mean() == pytest.approx(2 * red.array.mean(), rel=1e-4)
    del scene.lights[0]
    assert sr.render(scene, spp=4).array.max() == 0.0
    scene.shapes.append(sr.Sphere(0.5, world_from_object=sr.translate(0, 0, 4), area_light=10.0))
    assert sr.render(scene, spp=4).array.max() > 0.0


def test_an_edited_file_renders_as_if_it_had_been_written_so() -> None:
    text = (SCENES / "small-lamp.pbrt").read_text()
    Path("moved.pbrt").write_text(text.replace('"float fov" [ 38 ]', '"float fov" [ 60 ]'))
    scene = sr.load(SCENES / "small-lamp.pbrt")
    sr.render(scene, **TINY)
    scene.camera = scene.camera.replace(fov=60.0)
    expected = sr.render("moved.pbrt", **TINY)
    assert np.allclose(sr.render(scene, **TINY).array, expected.array, rtol=1e-4, atol=1e-6)


def test_textures_media_objects_and_motion() -> None:
    checks = sr.CheckerboardTexture(0.9, b=0.1)
    part = {"name": "part", "shapes": [sr.Sphere(0.4), sr.Disk(1.0, material=sr.DiffuseMaterial(checks))]}
    motion = {"start": sr.translate(0, 0, 1), "end": sr.translate(0.5, 0, 1) @ sr.rotate((0, 0, 1), 30)}
    scene = room(
        materials={"red": sr.DiffuseMaterial(checks), "glass": sr.DielectricMaterial(1.5, roughness=0.1)},
        objects=[part],
        instances=[sr.Instance("part", world_from_object=motion), sr.Instance(0, world_from_object=np.eye(4))],
    )
    assert len(scene.textures) == 1, "a thing that is used twice is there once"
    assert scene.instances[0].object == 0
    assert sr.render(scene, **TINY).array.mean() > 0


def test_a_furnace_glows_as_it_should() -> None:
    # A diffuse sphere of albedo 0.5 in light of radiance 1 shows 0.5 everywhere.
    scene = sr.Scene(
        camera=sr.PerspectiveCamera(20, world_from_camera=sr.look_at((0, -10, 0), (0, 0, 0))),
        film={"resolution": (8, 8)},
        shapes=[sr.Sphere(3.0, material=sr.DiffuseMaterial(0.5))],
        lights=[sr.InfiniteConstantLight(1.0)],
    )
    image = sr.render(scene, integrator="path", spp=64)
    assert image.array.mean() == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    ("thing", "message"),
    [
        ({"type": "spere"}, "there is no type 'spere'; did you mean `sphere`?"),
        ({"type": "sphere", "radus": 1}, "has no `radus`; did you mean `radius`?"),
        ({"type": "sphere", "radius": -1}, "radius is -1: expected a number above 0"),
        ({"type": "sphere", "radius": float("nan")}, "expected a number"),
        ({"type": "sphere", "material": "rde"}, "there is no material 'rde'; did you mean `red`?"),
        ({"type": "sphere", "material": 99}, "no number 99"),
        ({"type": "sphere", "material": {"type": "diffus"}}, "did you mean `diffuse`?"),
        ({"type": "sphere", "world_from_object": np.zeros((4, 4))}, "has no inverse"),
        ({"type": "sphere", "world_from_object": [1, 2]}, "expected a matrix of shape"),
        ({"type": "mesh", "positions": QUAD, "indices": [[0, 1, 4]]}, "index 4 of 4 positions"),
        ({"type": "mesh", "positions": QUAD, "indices": [[0, 1, -1]]}, "expected whole numbers from 0"),
        ({"type": "mesh", "positions": QUAD}, "expected a multiple of 3"),
        ({"type": "mesh", "positions": QUAD[:, :2]}, "expected (n, 3)"),
        ({"type": "mesh", "positions": QUAD[:3] + np.inf}, "not finite"),
        ({"type": "mesh", "positions": QUAD[:3], "normals": QUAD[:2]}, "2 normals for 3 positions"),
        ({"type": "mesh", "positions": QUAD[:3], "end_positions": QUAD[:2]}, "2 end_positions for 3 positions"),
        ({"type": "mesh", "positions": QUAD[:3], "end_positions": QUAD[:3], "key_times": 1}, "expected two numbers"),
        ({"type": "disk", "inner_radius": 2}, "inner_radius 2 is outside"),
        ({"type": "loop_subdiv", "positions": QUAD[:3], "levels": 40}, "expected at most 10"),
        (3, "expected a description"),
    ],
)
def test_what_is_refused_says_why(thing: Any, message: str) -> None:
    with pytest.raises(sr.SceneError) as e:
        room(shapes=[thing])
    assert message in str(e.value)


def test_a_scene_that_cannot_be_is_refused() -> None:
    with pytest.raises(sr.SceneError, match="a scene has no `shape`"):
        sr.Scene({"shape": []})
    with pytest.raises(sr.SceneError, match="camera has no meaning"):
        sr.render(room(camera=sr.PerspectiveCamera(200.0)), **TINY)
    with pytest.raises(sr.SceneError, match="cannot read image"):
        sr.render(room(materials={"red": sr.DiffuseMaterial(sr.ImageMapTexture("none.png"))}), **TINY)
    scene = room()
    with pytest.raises(sr.SceneError, match="later thing"):
        scene.materials["red"] = sr.MixMaterial([0, 0], amount=0.5)
    with pytest.raises(sr.SceneError, match="cannot be taken away"):
        del scene.materials["red"]
    with pytest.raises(KeyError):
        scene.materials["green"]
    with pytest.raises(sr.SceneError, match="no length"):
        sr.look_at((0, 0, 0), (0, 0, 0))
