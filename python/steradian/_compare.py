"""The laboratory: which method, how much noise, how long, and is it right?"""

from __future__ import annotations

import base64
import html
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import _native, _progress
from ._image import Array, Image
from ._scene import Scene, _text, load
from .errors import ParameterError

Method = str | Mapping[str, object]
Methods = str | Sequence[str] | Mapping[str, Method]


@dataclass(frozen=True)
class Interval:
    """A value and the interval that holds it with 95 % (NaN where there is one run only)."""

    value: float
    low: float
    high: float

    def __format__(self, spec: str) -> str:
        return f"{self.value:{spec}} ({self.low:{spec}} … {self.high:{spec}})"


@dataclass(frozen=True)
class MethodFigures:
    """What was measured of one method. Errors are without the reference's own noise; seconds are of rendering alone."""

    label: str
    #: Every setting, as films record it.
    settings: str
    #: Is its expected value the right image?
    unbiased: bool
    #: What it cannot find, in a sentence.
    misses: str
    runs: int
    #: Mean samples per pixel of a run.
    spp: float
    seconds: float
    mrays_per_second: float
    #: Mean over runs of (x - r)² / (r² + 0.01).
    relmse: Interval
    #: The same without the worst thousandth of the pixels.
    trimmed_relmse: Interval
    #: Mean FLIP error of the first run, from 0 to 1.
    flip: float
    #: 1 / (relMSE · seconds).
    efficiency: Interval
    #: The exponent of relMSE over samples: -1 for independent samples. None for short runs.
    slope: Interval | None
    #: The exponent of relMSE over time.
    slope_over_time: Interval | None
    #: The share of relMSE that the film's own variance explains; what is missing from 1 is bias, or unseen noise.
    explained_by_noise: float
    #: Mean R, G, B over the reference's.
    mean_ratio: tuple[float, float, float]


@dataclass(frozen=True)
class Verdict:
    """Do two methods, or one and the reference, have one mean? The worst of Welch tests on tiles of the picture.

    The false-alarm rate of all verdicts of a comparison together is 1 %.
    """

    a: str
    b: str
    agrees: bool
    #: The largest |t|, and its probability before the number of tests is taken into account.
    statistic: float
    p_value: float
    tests: int
    #: Column and row of the worst tile, and the difference there relative to `b`.
    tile: tuple[int, int]
    difference: float


@dataclass(frozen=True)
class Advice:
    """What a pilot says of a method."""

    label: str
    #: Seconds of rendering to the wanted error; for biased methods of the noise alone.
    seconds: Interval
    #: Samples per pixel that this means.
    spp: float
    unbiased: bool
    #: What speaks against it: another method found more light.
    objection: str | None
    recommended: bool


class Comparison:
    """Methods side by side on one scene. Shows itself in a notebook; `save` writes the report."""

    def __init__(self, native: _native.Comparison, title: str, command: str) -> None:
        self._native = native
        #: What the report calls it.
        self.title = title
        #: What was called to make it.
        self.command = command
        #: All figures as a dict, as ``comparison.json`` has them.
        self.figures: dict[str, Any] = json.loads(native.figures())
        #: Figures by method, in the order asked for.
        self.methods: dict[str, MethodFigures] = {m["label"]: _method(m) for m in self.figures["methods"]}
        #: Every pair of unbiased methods, and every method against ``"reference"`` if its noise is known.
        self.verdicts: list[Verdict] = [
            _verdict(a["a"], a["b"], a["verdict"]) for a in self.figures["agreements"]
        ]

    def agree(self, a: str, b: str) -> bool:
        """Did no test tell `a` from `b`? Either may be ``"reference"``; KeyError if the pair was not tested."""
        for verdict in self.verdicts:
            if {verdict.a, verdict.b} == {a, b}:
                return verdict.agrees
        raise KeyError((a, b))

    def picture(self, label: str = "reference") -> Array:
        """The picture of a method's first run, or of the reference: linear R, G, B, (height, width, 3)."""
        return self._native.picture(self._index(label))[0]

    def variance(self, label: str = "reference") -> Array:
        """The variance of that picture, of the same shape; zero if it is not known."""
        return self._native.picture(self._index(label))[1]

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the report. ``name.html``: one page that opens without a network, and ``name.json`` with all figures beside
        it. Anything else is a folder: report.html, comparison.json, and each picture as EXR with its variance.
        """
        path = Path(path)
        if path.suffix.lower() in (".html", ".htm"):
            path.write_text(self._native.page(self.title, self.command), encoding="utf-8")
            path.with_suffix(".json").write_text(json.dumps(self.figures, indent=2), encoding="utf-8")
        else:
            path.mkdir(parents=True, exist_ok=True)
            self._native.save(path, self.title, self.command)
        return path

    def __repr__(self) -> str:
        n = len(self.figures["seeds"])
        return f"<steradian.Comparison of {', '.join(self.methods)}; {n} runs, {self.figures['budget']}>"

    def __str__(self) -> str:
        lines = [f"{'method':<24}{'spp':>8}{'seconds':>9}{'relMSE':>11}{'FLIP':>8}{'efficiency':>13}"]
        for m in self.methods.values():
            lines.append(
                f"{m.label:<24}{m.spp:>8.0f}{m.seconds:>9.2f}{m.relmse.value:>11.2e}{m.flip:>8.3f}{m.efficiency.value:>13.3e}"
            )
        for v in self.verdicts:
            lines.append(
                f"{v.a} and {v.b} {'agree' if v.agrees else 'differ'}: |t| = {v.statistic:.2f}, p = {v.p_value:.1e}, "
                f"{100 * v.difference:+.2f} %"
            )
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        best = max((m.efficiency.value for m in self.methods.values()), default=0.0)
        rows = []
        for m in self.methods.values():
            cells = [
                f"{m.spp:.0f}",
                f"{m.seconds:.2f} s",
                f"{m.relmse:.2e}",
                f"{m.flip:.3f}",
                f"{m.efficiency:.3g}",
                "–" if m.slope is None else f"{m.slope.value:.2f}",
            ]
            name = html.escape(m.label)
            name = f"<b>{name}</b>" if m.efficiency.value == best else name
            rows.append(f"<tr><td>{name}</td>{''.join(f'<td>{c}</td>' for c in cells)}</tr>")
        head = "".join(
            f"<th>{h}</th>" for h in ["method", "samples", "time", "relMSE", "FLIP", "efficiency", "slope"]
        )
        verdicts = "".join(
            f"<li>{html.escape(v.a)} and {html.escape(v.b)} {'agree' if v.agrees else '<b>differ</b>'}: "
            f"|t| = {v.statistic:.2f}, p = {v.p_value:.1e}, {100 * v.difference:+.2f} %</li>"
            for v in self.verdicts
        )
        return (
            f"<div><b>{html.escape(self.title)}</b>, {html.escape(self.figures['budget'])}, "
            f"{len(self.figures['seeds'])} runs<table><tr>{head}</tr>{''.join(rows)}</table>"
            f"<div style='display:flex;flex-wrap:wrap;gap:8px'>{self._thumbnails()}</div><ul>{verdicts}</ul></div>"
        )

    def _thumbnails(self) -> str:
        figures = []
        for label in [*self.methods, "reference"]:
            png = base64.b64encode(_native.png(np.ascontiguousarray(self.picture(label)), 0.0, True)).decode()
            figures.append(
                f"<figure style='margin:0'><img src='data:image/png;base64,{png}' alt='{html.escape(label)}'>"
                f"<figcaption>{html.escape(label)}</figcaption></figure>"
            )
        return "".join(figures)

    def _index(self, label: str) -> int | None:
        if label == "reference":
            return None
        try:
            return list(self.methods).index(label)
        except ValueError:
            raise KeyError(label) from None


def compare(
    scene: Scene | str | os.PathLike[str],
    integrators: Methods,
    *,
    spp: int | None = None,
    time: float | None = None,
    seeds: int = 3,
    seed: int = 0,
    reference: Image | Array | str | os.PathLike[str] | None = None,
    reference_integrator: str = "path",
    reference_error: float = 1e-4,
    reference_time: float = 60.0,
    cache: str | os.PathLike[str] | None = None,
    threads: int | None = None,
    resolution: tuple[int, int] | None = None,
    crop: tuple[int, int, int, int] | None = None,
    spectral: bool = False,
    title: str | None = None,
    progress: bool = True,
    on_progress: Callable[[dict[str, Any]], bool | None] | None = None,
) -> Comparison:
    """Compares methods on one scene, as ``steradian compare``.

    `integrators` are names, or ``"path:mis=false:max_depth=3"``; as a mapping, labels with such a text or a dict of
    ``{"integrator": "path", "mis": False}``. Every run takes `spp` samples per pixel or renders for `time` seconds (default: 5);
    each method runs `seeds` times, from the seed `seed` on, and intervals come from the spread.

    Errors are against `reference` (an image, an array (height, width, 3), or a picture file), or against a render by
    `reference_integrator` whose estimated relMSE is below `reference_error`, if `reference_time` seconds allow; it is kept in
    `cache` (default: the user's cache folder) for the next time.

    `on_progress` hears events as dicts; if it returns True, or on Ctrl-C, what is complete is compared.
    Raises ParameterError, SceneError, FilmError.
    """
    if spp is not None and time is not None:
        raise ParameterError("only one of spp and time can say when a run stops")
    for name, value in (("spp", spp), ("seeds", seeds)):
        if value is not None and value < 1:
            raise ParameterError(f"{name} cannot be {value}: expected a whole number from 1")
    folder = Path(cache) if cache is not None else _native.reference_cache()
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
    request: dict[str, Any] = {
        "methods": _methods(integrators),
        "spp": spp,
        "time": 5.0 if time is None else float(time),
        "seeds": [seed + i for i in range(seeds)],
        "reference": None if reference is None else _reference(reference),
        "reference_integrator": reference_integrator,
        "reference_error": reference_error,
        "reference_time": float(reference_time),
        "cache": folder,
        "threads": threads,
        "resolution": resolution,
        "crop": crop,
        "spectral": spectral,
    }
    stem = None if isinstance(scene, Scene) else Path(scene).stem
    scene = scene if isinstance(scene, Scene) else load(scene)
    with _progress.heard(progress, on_progress) as listener:
        native = _native.compare(scene._native, request, listener)
    return Comparison(native, title or stem or "Comparison", _call("compare", stem, request))


def advise(
    scene: Scene | str | os.PathLike[str],
    integrators: Methods = (),
    *,
    error: str | float = "5%",
    pilot: float = 1.0,
    allow_biased: bool = False,
    threads: int | None = None,
    resolution: tuple[int, int] | None = None,
    crop: tuple[int, int, int, int] | None = None,
    spectral: bool = False,
    progress: bool = True,
    on_progress: Callable[[dict[str, Any]], bool | None] | None = None,
) -> list[Advice]:
    """Says which integrator reaches an error soonest, by short pilots, as ``steradian advise``. The best comes first.

    `error` is √relMSE, such as ``"5%"`` or ``0.05``; each method renders three pilots of `pilot` seconds. Without `integrators`
    those are asked that show all light of the scene. Biased methods are recommended only with `allow_biased`, by their
    noise alone. Raises ParameterError, SceneError.
    """
    asked = {
        "methods": _methods(integrators),
        "error": _text(error),
        "pilot": float(pilot),
        "allow_biased": allow_biased,
        "threads": threads,
        "resolution": resolution,
        "crop": crop,
        "spectral": spectral,
    }
    scene = scene if isinstance(scene, Scene) else load(scene)
    with _progress.heard(progress, on_progress) as listener:
        found = json.loads(_native.advise(scene._native, asked, listener))
    return [Advice(**{**a, "seconds": _interval(a["seconds"]), "spp": _number(a["spp"])}) for a in found]


def _methods(given: Methods) -> list[tuple[str, str]]:
    """Labels and methods as the command line writes them."""
    if isinstance(given, str):
        given = given.split(",")
    if isinstance(given, Mapping):
        return [(label, _method_text(method)) for label, method in given.items()]
    return [(text.strip(), text) for text in given]


def _method_text(method: Method) -> str:
    if isinstance(method, str):
        return method
    if "integrator" not in method:
        raise ParameterError("a method as a dict needs an `integrator`")
    settings = "".join(f":{name}={_text(value)}" for name, value in method.items() if name != "integrator")
    return f"{method['integrator']}{settings}"


def _reference(given: Image | Array | str | os.PathLike[str]) -> tuple[str, Array, Array | None]:
    if isinstance(given, Image):
        return "an image", given.array, given.variance
    if isinstance(given, (str, os.PathLike)):
        picture, variance, _ = _native.load_picture(Path(given))
        return str(given), picture, variance
    return "an array", np.ascontiguousarray(given, np.float32), None


def _call(function: str, scene: str | None, request: Mapping[str, Any]) -> str:
    """What was called, for the report: enough to call it again."""
    budget = f"spp={request['spp']}" if request["spp"] is not None else f"time={request['time']:g}"
    methods = {label: text for label, text in request["methods"]}
    shown = list(methods.values()) if all(k == v for k, v in methods.items()) else methods
    parts = [repr(scene) if scene else "scene", repr(shown), budget, f"seeds={len(request['seeds'])}"]
    if request["seeds"][0] != 0:
        parts.append(f"seed={request['seeds'][0]}")
    parts += [f"{k}={request[k]!r}" for k in ("resolution", "crop") if request[k] is not None]
    return f"sr.{function}({', '.join(parts)})"


def _number(x: float | None) -> float:
    """JSON has no infinity and no NaN: they come as null."""
    return float("nan") if x is None else float(x)


def _interval(d: Mapping[str, Any]) -> Interval:
    return Interval(_number(d["value"]), _number(d["low"]), _number(d["high"]))


def _verdict(a: str, b: str, v: Mapping[str, Any]) -> Verdict:
    plain = {k: v[k] for k in ("agrees", "statistic", "p_value", "tests")}
    return Verdict(a, b, **plain, tile=(v["tile"][0], v["tile"][1]), difference=_number(v["difference"]))


def _method(m: Mapping[str, Any]) -> MethodFigures:
    slope = m["slope"]
    plain = ("label", "settings", "unbiased", "misses", "runs", "spp", "seconds", "mrays_per_second", "flip")
    return MethodFigures(
        **{k: m[k] for k in plain},
        relmse=_interval(m["relmse"]),
        trimmed_relmse=_interval(m["trimmed_relmse"]),
        efficiency=_interval(m["efficiency"]),
        explained_by_noise=_number(m["explained_by_noise"]),
        slope=None if slope is None else _interval(slope["samples"]),
        slope_over_time=None if slope is None else _interval(slope["time"]),
        mean_ratio=(m["mean_ratio"][0], m["mean_ratio"][1], m["mean_ratio"][2]),
    )
