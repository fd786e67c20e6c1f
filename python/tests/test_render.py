"""Rendering: the same bits however it is asked for, and an end to everything that can be stopped."""

import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import SCENES

import steradian as sr

SMALL = {"resolution": (24, 16), "integrator": "path"}


def test_an_image_has_pixels_variance_and_the_recipe(lamp: sr.Scene) -> None:
    image = sr.render(lamp, spp=8, seed=3, max_depth=2, **SMALL)
    assert image.array.dtype == np.float32 and image.array.shape == (16, 24, 3)
    assert image.variance.shape == (16, 24, 3) and np.isfinite(image.variance).all()
    assert image.array.mean() > 0
    about = image.metadata
    assert (about["spp"], about["passes"], about["seed"], about["integrator"]) == (8, "0..8", 3, "path")
    assert "max_depth=2" in about["settings"] and about["rays"] > 0 and not about["interrupted"]
    assert about["mean"] == pytest.approx(image.array.mean(axis=(0, 1)), rel=1e-5)
    assert repr(image) == "<steradian.Image 24x16, 8 passes of path>"
    with pytest.raises(ValueError):
        image.array[0, 0] = 1.0


def test_threads_seeds_and_settings(lamp: sr.Scene) -> None:
    one = sr.render(lamp, spp=4, threads=1, **SMALL).to_bytes()
    assert one == sr.render(lamp, spp=4, threads=2, **SMALL).to_bytes()
    assert one != sr.render(lamp, spp=4, seed=1, **SMALL).to_bytes()
    assert one != sr.render(lamp, spp=4, sampler="sobol", **SMALL).to_bytes()


@pytest.mark.parametrize("integrator", ["path", "light", "mlt"])
def test_a_resumed_render_is_the_long_one(lamp: sr.Scene, integrator: str) -> None:
    # What mlt's pilot traces is traced again, and counted: a small one.
    settings = {"pilot": 64} if integrator == "mlt" else {}

    def shot(**how: object) -> sr.Image:
        return sr.render(lamp, resolution=(16, 16), integrator=integrator, seed=5, **settings, **how)

    whole = shot(spp=7)
    short = shot(spp=3)
    assert sr.resume(short, more=4).to_bytes() == whole.to_bytes()
    assert sr.resume(short, more=4).metadata["rays"] == pytest.approx(whole.metadata["rays"], rel=0.2)

    # By way of a file, which knows all but the scene.
    short.save("short.partial")
    assert sr.resume("short.partial", more=4, scene=lamp).to_bytes() == whole.to_bytes()
    with pytest.raises(sr.ResumeError, match="give it, as scene="):
        sr.resume("short.partial", more=4)
    with pytest.raises(sr.ResumeError, match="scenes"):
        sr.resume("short.partial", more=4, scene=SCENES / "points.pbrt")


def test_parts_merge_to_the_whole_in_any_order(lamp: sr.Scene) -> None:
    whole = sr.render(lamp, spp=6, **SMALL)
    parts = [sr.render(lamp, passes=p, **SMALL) for p in [(4, 6), (0, 1), (1, 4)]]
    merged = sr.merge([parts[0], parts[1].to_bytes(), parts[2], parts[1]])
    assert merged.to_bytes() == whole.to_bytes() and merged.metadata["duplicates"] == 1
    assert sr.resume(merged, more=1).metadata["passes"] == "0..7"
    with pytest.raises(sr.FilmError, match="already in the film"):
        sr.merge([whole, sr.render(lamp, passes=(5, 8), **SMALL)])
    with pytest.raises(sr.FilmError, match="seeds"):
        sr.merge([whole, sr.render(lamp, passes=(6, 8), seed=9, **SMALL)])


def test_files_keep_what_they_can(lamp: sr.Scene) -> None:
    image = sr.render(lamp, spp=4, **SMALL)
    for name in ["a.exr", "a.pfm", "a.hdr", "a.png", "a.partial"]:
        assert image.save(name) == Path(name) and Path(name).stat().st_size > 0
    assert (sr.read("a.exr") == image.array).all()
    assert sr.diff(image, "a.exr")["mse"] == 0.0 and sr.diff("a.partial", image.array)["mse"] == 0.0
    shown = np.abs(sr.read("a.png") - image.array.clip(0, 1))
    assert 0 < shown.max() < 0.01
    with pytest.raises(sr.OutputError, match="endings .exr, .png, .hdr and .pfm"):
        image.save("a.jpg")
    with pytest.raises(OSError):
        image.save("nowhere/a.exr")
    with pytest.raises(sr.FilmError):
        sr.diff(image, image.array[:-1])
    Path("broken.partial").write_bytes(b"x" * 100)
    with pytest.raises(sr.FilmError, match="broken.partial"):
        sr.Image.load("broken.partial")


def test_an_image_pickles_and_shows_itself(lamp: sr.Scene) -> None:
    image = sr.render(lamp, spp=2, **SMALL)
    again = pickle.loads(pickle.dumps(image))
    assert again.to_bytes() == image.to_bytes() and again.metadata == image.metadata
    assert image._repr_png_().startswith(b"\x89PNG")
    assert np.asarray(image).shape == (16, 24, 3)


def test_a_checkpoint_is_gone_on_from(lamp: sr.Scene) -> None:
    how = {"checkpoint": "c.partial", **SMALL}
    sr.render(lamp, spp=3, **how)
    resumed = sr.render(lamp, spp=5, resume=True, **how)
    assert resumed.metadata["passes_resumed"] == 3
    assert resumed.to_bytes() == sr.render(lamp, spp=5, **SMALL).to_bytes()
    with pytest.raises(sr.ResumeError, match="c.partial cannot be resumed"):
        sr.render(lamp, spp=5, seed=8, resume=True, **how)


def test_crops_are_parts_of_the_whole(lamp: sr.Scene) -> None:
    whole = sr.render(lamp, spp=2, **SMALL)
    crop = sr.render(lamp, spp=2, crop=(5, 3, 14, 9), **SMALL)
    assert (crop.array == whole.array[3:9, 5:14]).all()


def test_errors_say_what_the_command_line_says(lamp: sr.Scene) -> None:
    with pytest.raises(sr.ParameterError, match="there is no integrator `pth`; there are ao, direct"):
        sr.render(lamp, integrator="pth")
    with pytest.raises(sr.ParameterError, match="has no parameter `colour`"):
        sr.render(lamp, integrator="path", colour=3)
    with pytest.raises(ValueError, match="expected a whole number, or none"):
        sr.render(lamp, integrator="path", max_depth="deep")
    with pytest.raises(sr.ParameterError, match="only one of"):
        sr.render(lamp, spp=1, time=1.0)
    for how in [{"threads": 0}, {"time": -1.0}, {"time": float("nan")}, {"passes": (3, 3)}, {"spp": 0}]:
        with pytest.raises(ValueError):
            sr.render(lamp, **how)
    with pytest.raises(sr.SceneError, match="sampler` cannot be `sobl`"):
        sr.render(lamp, sampler="sobl")
    with pytest.raises(sr.SceneError, match="nowhere.pbrt"):
        sr.load("nowhere.pbrt")
    with pytest.raises(sr.SceneError, match="crop must overlap"):
        sr.render(lamp, crop=(900, 900, 901, 901))
    with pytest.raises(MemoryError):
        sr.render(lamp, resolution=(16000, 16000))

    Path("bad.pbrt").write_text("WorldBegin\nShape \"spere\"\nMaterial \"difuse\"\n")
    with pytest.raises(sr.SceneError) as e:
        sr.load("bad.pbrt")
    said = subprocess.run(
        [sys.executable, "-m", "steradian", "info", "bad.pbrt"], capture_output=True, text=True
    )
    assert said.returncode == 2
    for line in str(e.value).splitlines():
        assert line in said.stderr


def test_warnings_are_pythons() -> None:
    text = (SCENES / "small-lamp.pbrt").read_text()
    Path("odd.pbrt").write_text(text.replace('"rgb"', '"gbuffer"', 1))
    with pytest.warns(sr.SceneWarning, match="odd.pbrt"):
        sr.load("odd.pbrt")
    with pytest.raises(sr.SceneError):
        sr.load("odd.pbrt", strict=True)


def test_events_tell_how_far_it_is_and_may_stop_it(lamp: sr.Scene) -> None:
    events: list[dict[str, object]] = []
    sr.render(lamp, spp=8, on_progress=events.append, **SMALL)
    assert events and events[0]["event"] == "progress" and events[0]["of_passes"] == 8
    stopped = sr.render(lamp, time=60, on_progress=lambda event: True, **SMALL)
    assert stopped.metadata["interrupted"] and stopped.spp >= 1

    def broken(event: object) -> None:
        raise ZeroDivisionError("in the callback")

    with pytest.raises(ZeroDivisionError, match="in the callback"):
        sr.render(lamp, time=60, on_progress=broken, **SMALL)


def test_ctrl_c_gives_what_there_is(lamp: sr.Scene) -> None:
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    start = time.monotonic()
    image = sr.render(lamp, time=60, **SMALL)
    assert time.monotonic() - start < 20
    assert image.metadata["interrupted"] and image.spp >= 1
    assert sr.render(lamp, spp=image.spp, **SMALL).to_bytes() == image.to_bytes()


def test_threads_of_python_render_side_by_side(lamp: sr.Scene) -> None:
    expected = sr.render(lamp, spp=4, **SMALL).to_bytes()
    scene, results = sr.load(SCENES / "small-lamp.pbrt"), []
    work = [
        threading.Thread(target=lambda: results.append(sr.render(scene, spp=4, **SMALL).to_bytes()))
        for _ in range(6)
    ]
    for t in work:
        t.start()
    for t in work:
        t.join(60)
    assert results == [expected] * 6


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_fork_renders_on(lamp: sr.Scene) -> None:
    expected = sr.render(lamp, spp=2, **SMALL).to_bytes()
    child = os.fork()
    if child == 0:
        same = sr.render(lamp, spp=2, **SMALL).to_bytes() == expected
        os._exit(0 if same else 1)
    for _ in range(600):
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            break
        time.sleep(0.05)
    else:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        pytest.fail("the child hangs")
    assert os.waitstatus_to_exitcode(status) == 0


def test_memory_does_not_grow(lamp: sr.Scene) -> None:
    def resident() -> int:
        pages = Path("/proc/self/statm").read_text().split()[1]
        return int(pages) * os.sysconf("SC_PAGE_SIZE")

    def shoot(n: int) -> None:
        for i in range(n):
            image = sr.render(lamp, spp=1, seed=i, **SMALL)
            assert image.array.shape == (16, 24, 3) and len(image.to_bytes()) > 0

    shoot(50)
    before = resident()
    shoot(1000)
    # A film of this size is 24·16·(144+…) bytes, some 80 kB: to keep one in ten would take 8 MB.
    assert resident() - before < 6 << 20


def test_the_command_has_all_its_sub_commands() -> None:
    command = Path(sys.executable).parent / "steradian"
    said = subprocess.run([command, "--help"], capture_output=True, text=True, check=True).stdout
    assert all(name in said for name in ["render", "merge", "info", "integrators", "diff", "bench", "replay"])
    done = subprocess.run(
        [command, "render", SCENES / "small-lamp.pbrt", "--spp", "1", "--resolution", "8x8", "-o", "a.pfm"],
        capture_output=True,
    )
    assert done.returncode == 0 and Path("a.pfm").exists()
    assert subprocess.run([command, "render", "--nonsense"], capture_output=True).returncode == 2
