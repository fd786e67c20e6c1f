"""What rendering on a cluster costs, measured on this machine: run it when nothing else runs.

    python benches/cluster.py speed [--seconds 60] [--rounds 3]     two nodes against one, and Ray against threads
    python benches/cluster.py figures -o docs/scale/measured.json   what docs/scale/simulate.py computes with

Needs the package, with a release build, and Ray. Each comparison is made in interleaved rounds; medians are told.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import steradian as sr
from steradian import _native

ROOT = Path(__file__).parents[1]
QUIET: dict[str, Any] = {"progress": False}


def seconds(work: Callable[[], Any]) -> float:
    """Wall time of some work."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def cluster_of(nodes: int) -> Callable[[], None]:
    """Starts Ray with so many one-CPU nodes beside a head without; gives what ends it."""
    import logging

    import ray
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    for _ in range(nodes):
        cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, log_to_driver=False, logging_level=logging.WARNING)
    cluster.wait_for_nodes()

    def end() -> None:
        ray.shutdown()
        cluster.shutdown()

    return end


def speed(args: argparse.Namespace) -> dict[str, Any]:
    """Two one-CPU nodes against one; Ray's two nodes against two plain threads."""
    scene = sr.load(args.scene)
    how = {"integrator": args.integrator, "resolution": (args.side, args.side), **QUIET}
    sr.render(scene, spp=2, threads=1, **how)
    per_pass = seconds(lambda: sr.render(scene, spp=8, threads=1, **how)) / 8
    spp = max(16, round(args.seconds / per_pass))
    print(f"{1e3 * per_pass:.1f} ms a pass on one thread: {spp} passes", file=sys.stderr)

    times: dict[str, list[float]] = {"one thread": [], "two threads": [], "one node": [], "two nodes": []}
    for i in range(args.rounds):
        for threads, name in ((1, "one thread"), (2, "two threads")):
            times[name].append(seconds(lambda t=threads: sr.render(scene, spp=spp, threads=t, **how)))
        for nodes, name in ((1, "one node"), (2, "two nodes")):
            end = cluster_of(nodes)
            try:
                # Starting Python on a node is the cluster's cost, once; a scene's way there and its compilation are the render's.
                # Enough tasks that every node gets some: one that starts late would still start in the measurement.
                warm = sr.cluster.render(scene, spp=20 * nodes, passes_per_task=5, seed=99, **how)
                assert len(warm.metadata["nodes"]) == nodes, "a node did not take part"
                times[name].append(seconds(lambda: sr.cluster.render(scene, spp=spp, **how)))
            finally:
                end()
        print(f"round {i + 1}: " + ", ".join(f"{k} {v[-1]:.2f} s" for k, v in times.items()), file=sys.stderr)

    pairs = list(zip(times["one node"], times["two nodes"], times["one thread"], times["two threads"], strict=True))
    return {
        "scene": str(args.scene),
        "passes": spp,
        "seconds": times,
        "two nodes over one": statistics.median(a / b for a, b, _, _ in pairs),
        "two threads over one": statistics.median(c / d for _, _, c, d in pairs),
        "overhead against two threads": statistics.median(b / d - 1 for _, b, _, d in pairs),
        "overhead against one thread": statistics.median(a / c - 1 for a, _, c, _ in pairs),
    }


def figures(args: argparse.Namespace) -> dict[str, Any]:
    """Bytes, and seconds of processor time, that do not depend on how many nodes there are."""
    import ray

    scene = sr.load(args.scene)
    side = args.side
    how = {"resolution": (side, side), "threads": 1, **QUIET}
    films = {name: sr.render(scene, integrator=name, spp=1, **how) for name in ("path", "bdpt")}
    data = {name: film._film.to_array() for name, film in films.items()}
    later = sr.render(scene, integrator="path", passes=(1, 2), **how)._film.to_array()

    def read() -> None:
        _native.Sum().add(data["path"])

    def merge() -> None:
        total = _native.Sum()
        total.add(data["path"])
        total.add(later)

    def best(work: Callable[[], Any]) -> float:
        """Processor time: of one thread, whatever else runs."""

        def once() -> float:
            began = time.process_time()
            work()
            return time.process_time() - began

        return min(once() for _ in range(7))

    added = best(merge) - best(read)  # The first is read and kept, the second read and added.
    packed = scene._native.pack()
    figures: dict[str, Any] = {
        "film_bytes_per_pixel": {name: len(d) / side**2 for name, d in data.items()},
        "film_pack_seconds_per_gb": best(films["path"]._film.to_array) / len(data["path"]) * 1e9,
        "film_add_seconds_per_gb": added / len(data["path"]) * 1e9,
        "scene_bytes": len(packed),
        "pixel_pass_microseconds": best(lambda: sr.render(scene, spp=2, **how)) / 2 / side**2 * 1e6,
        "machine": f"{os.cpu_count()} processors",
    }

    # A task that does next to nothing: start, scene lookup, result, bookkeeping.
    sr.cluster.connect("local")
    small = {"resolution": (4, 4), **QUIET}
    sr.cluster.render(scene, spp=64, passes_per_task=1, **small)
    began = time.process_time()
    sr.cluster.render(scene, spp=400, passes_per_task=1, **small)
    figures["task_driver_milliseconds"] = (time.process_time() - began) / 400 * 1e3
    ray.shutdown()
    return figures


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["speed", "figures"])
    parser.add_argument("--scene", type=Path, default=ROOT / "scenes/first-light.pbrt")
    parser.add_argument("--integrator", default="path")
    parser.add_argument("--side", type=int, default=256, help="pixels along a side")
    parser.add_argument("--seconds", type=float, default=60.0, help="of the render on one thread")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    found = {"speed": speed, "figures": figures}[args.what](args)
    text = json.dumps(found, indent=2) + "\n"
    if args.output is not None:
        args.output.write_text(text)
    print(text, end="")


if __name__ == "__main__":
    main()
