#!/usr/bin/env python3
"""What a render costs beside its samples: time from start to picture, peak memory, and how well two threads are used.

    python benches/fixed.py cost [--triangles 1000000] [--size 1920x1080] [--spp 1] [--rounds 3] [--scene FILE.pbrt] [--csv FILE]
        [--mitsuba PYTHON] [--cycles PYTHON] [--luxcore PYTHON] [--variants llvm_ad_rgb,scalar_rgb]
    python benches/fixed.py threads SCENE [--integrators path,bdpt,...] [--spp N | --seconds 20] [--size WxH] [--rounds 1] [--csv FILE]

`cost`: every renderer starts as a process, reads a binary PLY of that many triangles (hills under a white sky, one camera, 8 bounces,
box filter), renders, writes an EXR and ends; wall time, processor time and peak resident set (`wait4`) of the whole process, on two
threads: on a shared machine the processor time is what to look at. Each peer has a Python of its own with its wheel (`mitsuba`, `bpy`,
`pyluxcore`): pass the interpreters whose peers are to be measured. Rounds
are interleaved. With `--scene` Steradian renders that file alone, so that scenes that peers cannot read are measured too.

`threads`: passes a second with one thread and with two, and by two processes of one thread at a time: what the machine gives.
A render of so many passes is timed by the render's own clock.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

BOUNCES = 8

PLY = """
import sys, numpy as np
path, n = sys.argv[1], int(sys.argv[2])
side = max(2, round((n / 2) ** .5))
x = np.linspace(-50, 50, side + 1, dtype='f4')
gx, gy = np.meshgrid(x, x)
z = sum(a * np.sin(f * gx + p) * np.cos(f * gy + q) for a, f, p, q in
        [(4, .11, 0, 1), (2, .27, 2, .3), (1, .61, 4, 2), (.4, 1.7, 1, 1), (.1, 7.1, 3, 2)])
v = np.stack([gx, gy, z], -1).reshape(-1, 3).astype('<f4')
a = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
f = np.concatenate([np.stack([a, a + 1, a + side + 2], -1), np.stack([a, a + side + 2, a + side + 1], -1)], 1).reshape(-1, 3)
faces = np.empty(len(f), np.dtype([('c', 'u1'), ('i', '<i4', 3)]))
faces['c'], faces['i'] = 3, f
head = ('ply\\nformat binary_little_endian 1.0\\nelement vertex %d\\nproperty float x\\nproperty float y\\nproperty float z\\n'
        'element face %d\\nproperty list uchar int vertex_indices\\nend_header\\n' % (len(v), len(f)))
with open(path, 'wb') as out:
    out.write(head.encode()); out.write(v.tobytes()); out.write(faces.tobytes())
print(len(f))
"""

PBRT = """
Film "rgb" "integer xresolution" [{w}] "integer yresolution" [{h}] "string filename" "hills.exr"
PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
Sampler "paddedsobol" "integer pixelsamples" [1]
Integrator "path" "integer maxdepth" [{bounces}]
LookAt 0 -52 18  0 0 2  0 0 1
Camera "perspective" "float fov" 45
WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
Shape "plymesh" "string filename" "hills.ply"
"""

MITSUBA = """
import sys, mitsuba as mi
variant, folder, w, h, spp, bounces, out = sys.argv[1:]
mi.set_variant(variant)
if variant.startswith('llvm'):
    import drjit as dr
    dr.set_thread_count(2)
T = mi.ScalarTransform4f
scene = mi.load_dict({'type': 'scene',
    'integrator': {'type': 'path', 'max_depth': int(bounces) + 1},
    'sensor': {'type': 'perspective', 'fov': 45, 'fov_axis': 'smaller',
        'to_world': T().look_at(origin=[0, -52, 18], target=[0, 0, 2], up=[0, 0, 1]),
        'film': {'type': 'hdrfilm', 'width': int(w), 'height': int(h), 'pixel_format': 'rgb', 'rfilter': {'type': 'box'}},
        'sampler': {'type': 'independent', 'sample_count': int(spp)}},
    'sky': {'type': 'constant'},
    'hills': {'type': 'ply', 'filename': folder + '/hills.ply', 'face_normals': True,
        'bsdf': {'type': 'diffuse', 'reflectance': {'type': 'rgb', 'value': 0.5}}}})
mi.util.write_bitmap(out, mi.render(scene, spp=int(spp)), write_async=False)
"""

CYCLES = """
import sys, math, bpy, mathutils
folder, w, h, spp, bounces, out = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
sc = bpy.context.scene
sc.render.engine = 'CYCLES'
c = sc.cycles
c.device, c.samples, c.use_adaptive_sampling, c.use_denoising = 'CPU', int(spp), False, False
c.max_bounces = c.diffuse_bounces = c.glossy_bounces = int(bounces) - 1
c.pixel_filter_type, c.filter_width = 'BOX', 1.0
sc.render.threads_mode, sc.render.threads = 'FIXED', 2
sc.render.resolution_x, sc.render.resolution_y, sc.render.resolution_percentage = int(w), int(h), 100
sc.render.image_settings.file_format = 'OPEN_EXR'
sc.render.image_settings.color_mode, sc.render.image_settings.color_depth = 'RGB', '32'
camera = bpy.data.objects.new('camera', bpy.data.cameras.new('camera'))
sc.collection.objects.link(camera); sc.camera = camera
camera.data.sensor_fit, camera.data.angle = 'VERTICAL', math.radians(45)
eye = mathutils.Vector((0, -52, 18)); to = mathutils.Vector((0, 0, 2))
camera.location = eye; camera.rotation_euler = (to - eye).to_track_quat('-Z', 'Y').to_euler()
world = bpy.data.worlds.new('sky'); sc.world = world; world.use_nodes = True
sky = world.node_tree.nodes.get('Background') or world.node_tree.nodes.new('ShaderNodeBackground')
sky.inputs['Color'].default_value = (1, 1, 1, 1)
bpy.ops.wm.ply_import(filepath=folder + '/hills.ply')
mesh = bpy.context.selected_objects[0].data
grey = bpy.data.materials.new('grey'); grey.use_nodes = True
tree = grey.node_tree; tree.nodes.clear()
diffuse, surface = tree.nodes.new('ShaderNodeBsdfDiffuse'), tree.nodes.new('ShaderNodeOutputMaterial')
diffuse.inputs['Color'].default_value = (.5, .5, .5, 1)
tree.links.new(diffuse.outputs[0], surface.inputs['Surface'])
mesh.materials.clear(); mesh.materials.append(grey)
sc.render.filepath = out
bpy.ops.render.render(write_still=True)
"""

LUXCORE = """
import os, sys, time, pyluxcore as L
folder, w, h, spp, bounces, out = sys.argv[1:]
L.Init(lambda *x: None)
P, sc = L.Properties(), L.Scene()
def put(name, value): P.Set(L.Property(name, value))
import math
w, h = int(w), int(h)
fov = 45 if w <= h else 2 * math.degrees(math.atan(math.tan(math.radians(22.5)) * w / h))
put('scene.camera.type', 'perspective'); put('scene.camera.lookat.orig', [0., -52., 18.]); put('scene.camera.lookat.target', [0., 0., 2.])
put('scene.camera.up', [0., 0., 1.]); put('scene.camera.fieldofview', fov); put('scene.camera.autofocus.enable', False)
put('scene.lights.sky.type', 'constantinfinite'); put('scene.lights.sky.color', [1., 1., 1.])
put('scene.materials.grey.type', 'matte'); put('scene.materials.grey.kd', [.5, .5, .5])
put('scene.shapes.hills.type', 'mesh'); put('scene.shapes.hills.ply', folder + '/hills.ply')
put('scene.objects.hills.shape', 'hills'); put('scene.objects.hills.material', 'grey')
sc.Parse(P)
C = L.Properties()
n = int(bounces)
for k, v in {'renderengine.type': 'PATHCPU', 'sampler.type': 'SOBOL', 'film.width': w, 'film.height': h, 'native.threads.count': 2,
             'path.pathdepth.total': n, 'path.pathdepth.diffuse': n, 'path.pathdepth.glossy': n, 'path.pathdepth.specular': n,
             'film.filter.type': 'NONE', 'batch.haltspp': int(spp), 'film.imagepipelines.0.0.type': 'NOP', 'film.noiseestimation.warmup': 0,
             'film.outputs.0.type': 'RGB', 'film.outputs.0.filename': out}.items():
    C.Set(L.Property(k, v))
s = L.RenderSession(L.RenderConfig(C, sc)); s.Start()
while not s.HasDone():
    time.sleep(.01); s.UpdateStats()
s.Stop(); s.GetFilm().Save()
os._exit(0)
"""


def measured(command, cwd):
    """Wall and processor seconds, peak resident set in MB, and output of a process; None if it fails, and then why."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        start = time.monotonic()
        child = subprocess.Popen(command, cwd=cwd, stdout=out, stderr=err)
        _, status, usage = os.wait4(child.pid, 0)
        wall = time.monotonic() - start
        child.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        err.seek(0)
        if child.returncode != 0:
            return None, err.read().decode(errors="replace")[-400:]
        return (wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1000), out.read().decode(errors="replace")


def cost(args):
    args.steradian = str(Path(args.steradian).resolve())
    w, h = args.size.split("x")
    with tempfile.TemporaryDirectory() as folder:
        name, scene = args.scene, args.scene
        if scene is None:
            n = subprocess.run(
                [args.mitsuba or args.cycles or args.luxcore or sys.executable, "-c", PLY, f"{folder}/hills.ply", str(args.triangles)],
                check=True, capture_output=True, text=True,
            ).stdout.strip()
            scene, name = f"{folder}/hills.pbrt", f"hills of {n} triangles"
            Path(scene).write_text(PBRT.format(w=w, h=h, bounces=BOUNCES))
        ours = [args.steradian, "render", str(Path(scene).resolve()), "--resolution", args.size, "--spp", str(args.spp)]
        ours += ["--threads", "2", "--quiet", "--json", "-o", f"{folder}/ours.exr"]
        commands = {"steradian": ours}
        if args.before:
            commands["steradian before"] = [str(Path(args.before).resolve()), *ours[1:]]
        if args.scene is None:
            rest = [folder, w, h, str(args.spp), str(BOUNCES)]
            for variant in filter(None, args.variants.split(",")) if args.mitsuba else []:
                commands[f"mitsuba {variant}"] = [args.mitsuba, "-c", MITSUBA, variant, *rest, f"{folder}/mitsuba.exr"]
            if args.cycles:
                commands["cycles"] = [args.cycles, "-c", CYCLES, *rest, f"{folder}/cycles.exr"]
            if args.luxcore:
                commands["luxcore"] = [args.luxcore, "-c", LUXCORE, *rest, f"{folder}/luxcore.exr"]
        found, told = {}, {}
        for _ in range(args.rounds):
            for renderer, command in commands.items():
                figures, text = measured(command, folder)
                print(f"  {renderer}: {figures}", file=sys.stderr, flush=True)
                if figures is None:
                    print(f"{renderer}: {text}", file=sys.stderr)
                    continue
                found.setdefault(renderer, []).append(figures)
                if renderer.startswith("steradian"):
                    told.setdefault(renderer, []).append(json.loads(text))
    print(f"{name}, {args.size}, {args.spp} spp, 2 threads: medians of {args.rounds}")
    rows = []
    for renderer, figures in found.items():
        wall, cpu, rss = (statistics.median(x) for x in zip(*figures, strict=True))
        line = f"  {renderer:24} {wall:7.2f} s {cpu:7.2f} s of processors {rss:8.0f} MB"
        if renderer in told:
            load, render = (statistics.median(t[k] for t in told[renderer]) for k in ("load_seconds", "render_seconds"))
            line += f"   load {load:.2f} s, render {render:.2f} s, the rest {wall - load - render:.2f} s"
        print(line, flush=True)
        rows.append(f"{time.strftime('%Y-%m-%d')},cost,{name},{args.size},{args.spp},{renderer},{wall:.3f},{cpu:.3f},{rss:.0f}")
    record(args, "date,kind,scene,size,spp,renderer,wall_s,cpu_s,peak_mb", rows)


def threads(args):
    command = [args.steradian, "render", args.scene, "--quiet", "--json", "--resolution", args.size, "-o"]

    def start(integrator, n, spp, seed, folder):
        out = f"{folder}/{integrator}-{n}-{seed}.pfm"
        how = ["--integrator", integrator, "--threads", str(n), "--seed", str(seed)]
        how += ["--spp", str(spp)] if spp else ["--time", f"{args.seconds}s"]
        return subprocess.Popen([*command, out, *how], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def rate(child):
        text, problem = child.communicate()
        if child.returncode != 0:
            raise SystemExit(problem)
        told = json.loads(text)
        return told["spp"] / told["render_seconds"], told["spp"]

    rows = []
    print(f"{args.scene} {args.size}: passes a second of two threads over one, of two processes over one")
    with tempfile.TemporaryDirectory() as folder:
        for integrator in args.integrators.split(","):
            pairs = []
            for seed in range(1, args.rounds + 1):
                two, spp = rate(start(integrator, 2, args.spp, seed, folder))
                # As many passes with one thread: methods whose passes differ in work do the same work.
                one, _ = rate(start(integrator, 1, spp, seed, folder))
                both = [start(integrator, 1, spp, seed + k, folder) for k in range(2)]
                apart = sum(rate(child)[0] for child in both)
                pairs.append((two / one, apart / one, spp))
            ratio, limit, spp = (statistics.median(x) for x in zip(*pairs, strict=True))
            print(f"  {integrator:18} {ratio:6.3f} {limit:6.3f}   ({spp:.0f} passes)", flush=True)
            day = time.strftime("%Y-%m-%d")
            rows.append(f"{day},threads,{Path(args.scene).parent.name},{args.size},{spp:.0f},{integrator},{ratio:.4f},{limit:.4f}")
    record(args, "date,kind,scene,size,spp,integrator,two_threads,two_processes", rows)


def record(args, head, rows):
    if args.csv:
        file = Path(args.csv)
        with file.open("a") as out:
            if file.stat().st_size == 0:
                out.write(head + "\n")
            out.write("\n".join(rows) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(required=True)
    both = argparse.ArgumentParser(add_help=False)
    both.add_argument("--steradian", default="target/release/steradian")
    both.add_argument("--csv")
    one = kinds.add_parser("cost", parents=[both])
    one.set_defaults(run=cost)
    one.add_argument("--triangles", type=int, default=1_000_000)
    one.add_argument("--scene")
    one.add_argument("--size", default="1920x1080")
    one.add_argument("--spp", type=int, default=1)
    one.add_argument("--rounds", type=int, default=3)
    one.add_argument("--before", help="another steradian, to compare with")
    one.add_argument("--mitsuba")
    one.add_argument("--cycles")
    one.add_argument("--luxcore")
    one.add_argument("--variants", default="llvm_ad_rgb,scalar_rgb")
    two = kinds.add_parser("threads", parents=[both])
    two.set_defaults(run=threads)
    two.add_argument("scene")
    two.add_argument("--integrators", default="path")
    two.add_argument("--spp", type=int)
    two.add_argument("--seconds", type=float, default=20)
    two.add_argument("--size", default="640x360")
    two.add_argument("--rounds", type=int, default=1)
    args = parser.parse_args()
    args.run(args)


if __name__ == "__main__":
    main()
