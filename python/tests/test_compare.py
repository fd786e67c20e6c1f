"""The laboratory from Python: comparisons, advice, renders to an error."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from conftest import SCENES

import steradian as sr

SMALL = {"resolution": (24, 16), "progress": False}


@pytest.fixture(scope="module")
def compared(lamp: sr.Scene, tmp_path_factory: pytest.TempPathFactory) -> sr.Comparison:
    methods = {"with": "path", "without": {"integrator": "path", "shadow_rays": False}, "both ways": "bdpt", "local": "direct"}
    cache = tmp_path_factory.mktemp("cache")
    return sr.compare(
        lamp, methods, spp=16, seeds=4, reference_error=1e-3, reference_time=20, cache=cache, title="A lamp", **SMALL
    )


def test_a_comparison_has_errors_intervals_and_verdicts(compared: sr.Comparison) -> None:
    assert list(compared.methods) == ["with", "without", "both ways", "local"]
    path, blind, _, local = compared.methods.values()
    assert path.spp == 16 and path.runs == 4 and path.unbiased and "mis=true" in path.settings
    assert path.relmse.low < path.relmse.value < path.relmse.high < blind.relmse.low
    assert path.slope is not None and path.slope.low < -1 < path.slope.high + 0.3
    assert 0 < path.flip < blind.flip < 1 and path.efficiency.value > blind.efficiency.value

    # What is the same agrees; what lacks light does not.
    assert compared.agree("with", "both ways") and compared.agree("reference", "with")
    assert not compared.agree("local", "with")
    worst = next(v for v in compared.verdicts if {v.a, v.b} == {"local", "reference"})
    assert worst.p_value < 1e-4 and worst.difference < 0 and local.mean_ratio[0] < 0.97
    with pytest.raises(KeyError):
        compared.agree("with", "nothing")
    assert compared.picture("local").shape == compared.variance().shape == (16, 24, 3)
    assert compared.figures["reference"]["relmse"] > 0
    assert "agree" in str(compared) and "without" in repr(compared)


def test_a_comparison_shows_and_saves_itself(compared: sr.Comparison) -> None:
    html = compared._repr_html_()
    assert html.count("data:image/png") == 5 and "<b>differ</b>" in html
    assert compared.save("report.html") == Path("report.html")
    page = Path("report.html").read_text()
    assert "A lamp" in page and "sr.compare(scene" in page and "src=\"http" not in page
    assert json.loads(Path("report.json").read_text())["methods"][0]["label"] == "with"
    compared.save("folder")
    assert {p.name for p in Path("folder").iterdir()} == {
        "report.html", "comparison.json", "reference.exr", "with.exr", "without.exr", "both_ways.exr", "local.exr"
    }
    assert (sr.read("folder/with.exr") == compared.picture("with")).all()

    # A picture may be the reference, with its variance or without.
    again = sr.compare(SCENES / "small-lamp.pbrt", "path,bdpt", spp=4, reference="folder/reference.exr", **SMALL)
    assert again.title == "small-lamp" and again.agree("path", "reference")
    bare = sr.compare(SCENES / "small-lamp.pbrt", ["path"], spp=4, reference=compared.picture(), **SMALL)
    assert bare.verdicts == [] and math.isfinite(bare.methods["path"].relmse.value)


def test_comparisons_refuse_in_the_words_of_the_command_line(lamp: sr.Scene) -> None:
    with pytest.raises(sr.ParameterError, match="there is no integrator `pth`; there are ao"):
        sr.compare(lamp, "pth", **SMALL)
    with pytest.raises(sr.ParameterError, match="`mis` in `path:mis` is no setting"):
        sr.compare(lamp, "path:mis", **SMALL)
    with pytest.raises(sr.ParameterError, match="at least one method"):
        sr.compare(lamp, [], **SMALL)
    with pytest.raises(sr.ParameterError, match="does not have the 24 x 16 pixels"):
        sr.compare(lamp, "path", reference=np.ones((4, 4, 3), np.float32), **SMALL)
    with pytest.raises(sr.ParameterError, match="only one of"):
        sr.compare(lamp, "path", spp=1, time=1.0, **SMALL)
    for how in [{"spp": 0}, {"seeds": 0}, {"time": -1.0}]:
        with pytest.raises(ValueError):
            sr.compare(lamp, "path", **how, **SMALL)
    with pytest.raises(sr.FilmError, match="nowhere.exr"):
        sr.compare(lamp, "path", reference="nowhere.exr", **SMALL)


def test_steps_are_told_and_may_end_a_comparison(lamp: sr.Scene) -> None:
    steps: list[str] = []

    def hear(event: dict[str, object]) -> bool:
        if event["event"] == "step":
            steps.append(f"{event['label']} {event['number']}/{event['of']}")
        return len(steps) > 2

    compared = sr.compare(lamp, "path", spp=4, seeds=3, reference=lamp_picture(lamp), on_progress=hear, **SMALL)
    assert steps[:3] == ["reference 0/0", "path 1/3", "path 2/3"]
    assert compared.methods["path"].runs < 3


def lamp_picture(lamp: sr.Scene) -> sr.Image:
    return sr.render(lamp, integrator="path", spp=64, seed=99, **SMALL)


def test_advice_prefers_what_finds_the_light(lamp: sr.Scene) -> None:
    advice = sr.advise(lamp, ["path", "path:shadow_rays=false"], error="10%", pilot=0.2, **SMALL)
    assert advice[0].label == "path" and advice[0].recommended and not advice[1].recommended
    assert advice[0].seconds.value < advice[1].seconds.value and advice[0].unbiased and advice[0].spp > 0
    with pytest.raises(ValueError, match="expected an error above zero, such as 1% or 0.01"):
        sr.advise(lamp, "path", error="much")


def test_a_render_may_end_at_an_error(lamp: sr.Scene) -> None:
    image = sr.render(lamp, integrator="path", error="20%", **SMALL)
    assert image.metadata["relmse_estimate"] < 0.2**2
    assert image.to_bytes() == sr.render(lamp, integrator="path", error=0.2, threads=1, **SMALL).to_bytes()
    assert image.spp < sr.render(lamp, integrator="path", error="10%", **SMALL).spp
    with pytest.raises(ValueError, match="expected an error above zero"):
        sr.render(lamp, error="-1%", **SMALL)
    with pytest.raises(sr.ParameterError, match="only one of"):
        sr.render(lamp, error="1%", spp=4, **SMALL)


def test_flip_is_among_the_metrics(lamp: sr.Scene) -> None:
    image = lamp_picture(lamp)
    assert sr.diff(image, image)["flip"] == 0.0
    assert 0 < sr.diff(sr.render(lamp, integrator="path", spp=2, **SMALL), image)["flip"] < 1
