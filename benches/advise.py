"""How often is `advise` right? Over all scenes of `scenes/` and of the laboratory.

    python benches/advise.py [--pilot SECONDS] [--time SECONDS] [--size WxH]

For each scene `sr.advise` recommends one of the unbiased methods after its pilots. Then `sr.compare` lets each of them render for
much longer, with several seeds, against a reference: the method with the highest efficiency 1 / (trimmed relMSE · seconds) is the
best, and the regret is how many times as long the recommended one takes. The advice counts as right if it names the best method,
or one whose efficiency is not significantly lower (intervals overlap), and as good if the regret is below 1.25.
Also asked: does the time that was predicted for the recommended method hold, within its interval? Prints one JSON object last.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import steradian as sr

ROOT = Path(__file__).parents[1]
METHODS = ["path", "bdpt", "light", "mlt", "guided"]


def judge(path: Path, pilot: float, time: float, size: tuple[int, int]) -> dict[str, Any] | None:
    """One scene; None if no method can be recommended."""
    scene = sr.load(path)
    how: dict[str, Any] = {"resolution": size, "progress": False}
    able = [m for m in METHODS if can(scene, m)]
    advice = sr.advise(scene, able, error="5%", pilot=pilot, **how)
    best = advice[0]
    if not best.recommended:
        return {"scene": path.stem, "recommended": None}
    seen = [a.label for a in advice if a.objection is None]
    found = sr.compare(
        scene, seen, time=time, seeds=3, reference_integrator="bdpt" if "bdpt" in able else "path", reference_time=4 * time, **how
    )
    cost = {m.label: m.trimmed_relmse.value * m.seconds for m in found.methods.values()}
    truly = min(cost, key=lambda m: cost[m])
    regret = cost[best.label] / cost[truly]
    a, b = found.methods[best.label].trimmed_relmse, found.methods[truly].trimmed_relmse
    right = best.label == truly or a.low * found.methods[best.label].seconds <= b.high * found.methods[truly].seconds
    measured = found.methods[best.label].relmse.value * found.methods[best.label].seconds / 0.05**2
    return {
        "scene": path.stem,
        "recommended": best.label,
        "best": truly,
        "regret": regret,
        "right": right,
        "good": regret < 1.25,
        "predicted_seconds": [best.seconds.low, best.seconds.value, best.seconds.high],
        "measured_seconds": measured,
        "costs": cost,
    }


def can(scene: sr.Scene, method: str) -> bool:
    """Can it render the scene?"""
    try:
        sr.render(scene, integrator=method, spp=1, resolution=(4, 4), progress=False)
    except sr.ParameterError:
        return False
    return True


def main() -> None:
    """All scenes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pilot", type=float, default=1.0)
    parser.add_argument("--time", type=float, default=6.0)
    parser.add_argument("--size", default="128x96")
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    scenes = sorted([*ROOT.glob("scenes/*.pbrt"), *ROOT.glob("crates/lab/scenes/*.pbrt")])
    all_found = []
    for path in scenes:
        found = judge(path, given.pilot, given.time, (width, height))
        print(json.dumps(found), file=sys.stderr, flush=True)
        all_found.append(found)
    judged = [f for f in all_found if f and f["recommended"]]
    share = {k: sum(f[k] for f in judged) / max(len(judged), 1) for k in ("right", "good")}
    print(json.dumps({"scenes": len(judged), **share, "found": all_found}))


if __name__ == "__main__":
    main()
