"""What Python costs: figures that the project promises, measured with the installed package and its own `steradian` command.

    python benches/python.py [--quick]

- rays: `scene.intersect` on a million rays against the rays a second of `steradian bench` on the same scene (at least 70 %);
- renders: the time of `sr.render`, progress told, beyond the render's own (less than 2 %), and its render time against the command's;
- edits: another colour, camera and light in a scene of a million triangles against loading it (less than 5 %).

Pairs are interleaved and ratios are medians, so that a busy machine troubles both sides alike. Prints one JSON object last.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import steradian as sr

COMMAND = Path(sys.executable).parent / "steradian"

HEAD = """
Film "rgb" "integer xresolution" [ 1024 ] "integer yresolution" [ 1024 ]
Integrator "path" "integer maxdepth" [ 3 ]
LookAt 0 1.2 -2.2  0 0 0  0 1 0
Camera "perspective" "float fov" [ 45 ]
WorldBegin
LightSource "infinite" "rgb L" [ 0.7 0.8 1 ]
LightSource "distant" "rgb L" [ 2 1.9 1.7 ] "point3 from" [ 3 5 -2 ] "point3 to" [ 0 0 0 ]
Material "diffuse" "rgb reflectance" [ 0.6 0.5 0.4 ]
Shape "plymesh" "string filename" [ "hills.ply" ]
"""


def hills(folder: Path, side: int = 708) -> Path:
    """A scene of 2 (side - 1)² triangles: hills, as a pbrt file and a PLY mesh."""
    x, z = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side))
    y = 0.08 * np.sin(9 * x) * np.cos(7 * z) + 0.02 * np.sin(53 * x + 31 * z)
    points = np.stack([x, y, z], -1).reshape(-1, 3).astype("<f4")
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    quads = np.stack([corner, corner + side, corner + 1, corner + 1, corner + side, corner + side + 1], -1)
    faces = np.empty(2 * len(corner), [("n", "u1"), ("i", "<i4", 3)])
    faces["n"], faces["i"] = 3, quads.reshape(-1, 3)
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    (folder / "hills.ply").write_bytes(header.encode() + points.tobytes() + faces.tobytes())
    (folder / "hills.pbrt").write_text(HEAD)
    return folder / "hills.pbrt"


def command(*args: object) -> dict[str, Any]:
    """The last line of a command's output, as JSON."""
    done = subprocess.run([COMMAND, *map(str, args)], check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])  # type: ignore[no-any-return]  # what the command prints is an object


def seconds(call: Any) -> float:
    """How long a call takes."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def rays(path: Path, rounds: int) -> dict[str, float]:
    """Rays a second of `scene.intersect` over those of the command, for camera rays and cosine-distributed bounces."""
    scene = sr.load(path)
    at = np.arange(1024, dtype=np.float32) + np.float32(0.5)
    raster = np.stack(np.meshgrid(at, at), -1).reshape(-1, 2)
    camera = scene.camera_rays(raster)
    points = scene.surfaces(*camera)
    fields = points.valid
    u = np.random.default_rng(0).random((len(raster), 3), np.float32)
    wi = points.sample(u).wi
    bounce = tuple(np.ascontiguousarray(a[fields]) for a in points.spawn(wi))
    ratios: dict[str, list[float]] = {"camera": [], "bounce": []}
    for _ in range(rounds):
        told = command("bench", path, "--time", "1s", "--rays", "--json")
        for kind, (origins, directions) in (("camera", camera), ("bounce", bounce)):
            took = min(seconds(lambda o=origins, d=directions: scene.intersect(o, d)) for _ in range(3))
            ratios[kind].append(len(origins) / took / rate(told, kind))
    return {kind: statistics.median(r) for kind, r in ratios.items()}


def rate(told: dict[str, Any], kind: str) -> float:
    """Rays a second with the kernel that renders use: the fastest that this processor has."""
    return 1e6 * max(kernel[kind] for kernel in told["rays"])


def renders(path: Path, rounds: int, spp: int) -> dict[str, float]:
    """What `sr.render` takes beyond the render itself, and render times of Python over the command's."""
    scene = sr.load(path)
    how: dict[str, Any] = {"integrator": "path", "resolution": (512, 512), "progress": False, "on_progress": lambda e: None}
    sr.render(scene, spp=1, **how)
    beyond, against = [], []
    for _ in range(rounds):
        start = time.perf_counter()
        image = sr.render(scene, spp=spp, **how)
        wall = time.perf_counter() - start
        beyond.append(wall / image.metadata["render_seconds"] - 1)
        options = ("--spp", spp, "--integrator", "path", "--resolution", "512x512", "--quiet", "--json")
        with tempfile.TemporaryDirectory() as folder:
            told = command("render", path, *options, "-o", f"{folder}/a.pfm")
        against.append(image.metadata["render_seconds"] / told["render_seconds"])
    return {"beyond": statistics.median(beyond), "against_command": statistics.median(against)}


def edits(path: Path, rounds: int) -> dict[str, float]:
    """Seconds to load and to edit, and their ratio; an edit is the time until a render can begin."""
    loads, changes = [], []
    tiny: dict[str, Any] = {"spp": 1, "resolution": (2, 2), "progress": False}

    def fresh() -> sr.Scene:
        scene = sr.load(path)
        sr.render(scene, **tiny)
        return scene

    for i in range(rounds):
        scene = fresh()
        loads.append(seconds(fresh))

        def colour(i: int = i) -> None:
            scene.materials[1 if len(scene.materials) > 1 else 0] = sr.DiffuseMaterial((0.2, 0.1 + 0.01 * i, 0.3))

        def camera() -> None:
            scene.camera = scene.camera.replace(fov=scene.camera.fov + 1)

        def light() -> None:
            scene.lights[0] = sr.InfiniteConstantLight((0.5, 0.6, 0.8))

        for edit in (colour, camera, light):
            edit()
            changes.append(seconds(lambda: sr.render(scene, **tiny)))
    load, edit = statistics.median(loads), statistics.median(changes)
    return {"load_seconds": load, "edit_seconds": edit, "worst_edit_seconds": max(changes), "edit_over_load": edit / load}


def main() -> None:
    """Measures all, says what holds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    rounds = 3 if parser.parse_args().quick else 9
    with tempfile.TemporaryDirectory() as folder:
        path = hills(Path(folder))
        found = {"edits": edits(path, rounds), "rays": rays(path, rounds), "renders": renders(path, rounds, 16)}
    promises = {
        "intersect >= 70 % of bench": min(found["rays"].values()) >= 0.7,
        "render overhead < 2 %": found["renders"]["beyond"] < 0.02,
        "edit < 5 % of a load": found["edits"]["edit_over_load"] < 0.05,
    }
    for promise, holds in promises.items():
        print(f"{'holds' if holds else 'FAILS'}: {promise}", file=sys.stderr)
    print(json.dumps({**found, "promises": promises}))


if __name__ == "__main__":
    main()
