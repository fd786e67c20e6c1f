#!/usr/bin/env python3
"""Steradian beside Mitsuba 3 on the same Mitsuba XML files at equal time: paths per second and error.

    python benches/peers.py SCENE.xml ... [--steradian target/release/steradian] [--seconds 10] [--rounds 3]
        [--variants llvm_ad_rgb,scalar_rgb] [--depth 8] [--size 256x256] [--filter box] [--reference FILE.exr] [--csv FILE]

Needs `pip install mitsuba numpy` and for the llvm variants `DRJIT_LIBLLVM_PATH` (LLVM 19). One renderer runs at a time, on
`--threads`; rounds are interleaved, with other seeds. Mitsuba's compilation is not counted: one pass of the timed size
goes before. Both get the same size, depth (Steradian counts bounces, Mitsuba vertices: one less) and pixel filter, each its
own sampler. Error: relMSE = mean((x - r)^2 / (r^2 + 0.01)), the worst 0.1 % of pixels left out; the reference is given, or
made by Steradian's `path` in `--reference-seconds` (its noise is then in everybody's error alike).
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np


def read(path):
    import mitsuba as mi

    return np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))


def error(image, reference, dropped=0.001):
    e = np.sort(((image - reference) ** 2 / (reference**2 + 0.01)).mean(-1), axis=None)
    return float(e[: round(len(e) * (1 - dropped))].mean())


def variant(scene, args):
    """The file with the size, filter, sampler and depth that everybody gets."""
    import xml.etree.ElementTree as tree

    document = tree.parse(scene)
    root = document.getroot()
    width, height = map(int, args.size.split("x"))
    for node in root.iter("film"):
        for child in list(node):
            if child.get("name") in ("width", "height") or child.tag == "rfilter":
                node.remove(child)
        tree.SubElement(node, "integer", name="width", value=str(width))
        tree.SubElement(node, "integer", name="height", value=str(height))
        tree.SubElement(node, "rfilter", type=args.filter)
    for node in list(root.findall("integrator")):
        root.remove(node)
    integrator = tree.SubElement(root, "integrator", type="path")
    tree.SubElement(integrator, "integer", name="max_depth", value=str(args.depth + 1))
    path = Path(scene).parent / f".peers-{os.getpid()}-{Path(scene).name}"
    document.write(path)
    return path


def steradian(args, scene, seconds, seed, out):
    command = [args.steradian, "render", str(scene), "--output", str(out), "--threads", str(args.threads)]
    command += ["--time", f"{seconds}s", "--seed", str(seed), "--json", "--quiet", "--integrator", "path"]
    command += ["--set", "sampler=sobol"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


CHILD = """
import sys, time, json, numpy as np, mitsuba as mi, drjit as dr
variant, scene, seconds, seed, out, threads = sys.argv[1:]
seconds, seed = float(seconds), int(seed)
mi.set_variant(variant); dr.set_thread_count(int(threads))
scene = mi.load_file(scene); w, h = scene.sensors()[0].film().crop_size()
def render(spp, seed): return np.array(mi.render(scene, spp=spp, seed=seed))[..., :3].astype(np.float64)
most = max(1, int(24e6 / (w * h)))
render(1, 10**6 + seed); t = time.time(); render(2, 2 * 10**6 + seed); each = max(1e-4, (time.time() - t) / 2)
spp = int(min(most, max(1, seconds / 8 / each))); render(spp, 3 * 10**6 + seed)
total, n, k, t = 0, 0, 0, time.time()
while True:
    total = total + render(spp, seed * 1000 + k) * spp; n += spp; k += 1
    spent = time.time() - t
    if spent + 0.5 * spent / k >= seconds: break
np.save(out, (total / n).astype(np.float32))
print(json.dumps({"seconds": spent, "spp": n}))
"""


def mitsuba(args, kind, scene, seconds, seed, out):
    command = [sys.executable, "-c", CHILD, kind, str(scene), str(seconds), str(seed), str(out), str(args.threads)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--steradian", default="target/release/steradian")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--reference-seconds", type=float, default=120.0)
    parser.add_argument("--reference")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--variants", default="llvm_ad_rgb,scalar_rgb")
    parser.add_argument("--depth", type=int, default=8)
    parser.add_argument("--size", default="256x256")
    parser.add_argument("--filter", default="box")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--csv")
    args = parser.parse_args()
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    lines = ["date,scene,size,depth,filter,renderer,seconds,spp,mpaths_per_s,relmse_trimmed,mean_ratio"]
    pixels = np.prod([int(x) for x in args.size.split("x")])
    with tempfile.TemporaryDirectory() as folder:
        for scene in args.scenes:
            same = variant(scene, args)
            try:
                if args.reference:
                    reference = read(args.reference)
                else:
                    file = Path(folder) / "reference.pfm"
                    steradian(args, same, args.reference_seconds, 999, file)
                    reference = read(file)
                found = {}
                for round_ in range(args.rounds):
                    file = Path(folder) / "ours.pfm"
                    told = steradian(args, same, args.seconds, 1 + round_, file)
                    image = read(file)
                    row = (told["render_seconds"], told["spp"], error(image, reference), image.mean() / reference.mean())
                    found.setdefault("steradian", []).append(row)
                    for kind in filter(None, args.variants.split(",")):
                        file = Path(folder) / "theirs.npy"
                        told = mitsuba(args, kind, same, args.seconds, 1 + round_, file)
                        image = np.load(file)
                        row = (told["seconds"], told["spp"], error(image, reference), image.mean() / reference.mean())
                        found.setdefault(f"mitsuba-{mi.__version__}-{kind}", []).append(row)
            finally:
                same.unlink()
            print(f"{Path(scene).parent.name}/{Path(scene).name} {args.size}, {args.depth} bounces, {args.filter} filter")
            for name, rows in found.items():
                seconds, spp, relmse, ratio = np.median(np.array(rows), axis=0)
                rate = pixels * spp / seconds / 1e6
                print(f"  {name:32} {seconds:6.2f} s {spp:7.0f} spp {rate:7.3f} Mpaths/s  relMSE {relmse:.3e}  mean {ratio:.4f}")
                day = time.strftime("%Y-%m-%d")
                lines.append(
                    f"{day},{Path(scene).parent.name},{args.size},{args.depth},{args.filter},{name},"
                    f"{seconds:.3f},{spp:.0f},{rate:.4f},{relmse:.4e},{ratio:.5f}"
                )
    if args.csv:
        Path(args.csv).write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
