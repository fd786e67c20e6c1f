"""The guide's examples, and those in docstrings, do what they say."""

import doctest
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT, SCENES

import steradian as sr
from steradian import _lowlevel, _scene


def test_the_guide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    flags = doctest.IGNORE_EXCEPTION_DETAIL & 0
    done = doctest.testfile(str(ROOT / "docs/guide/python.md"), module_relative=False, optionflags=flags)
    assert done.attempted > 20 and done.failed == 0


@pytest.mark.parametrize("module", [_scene, _lowlevel])
def test_docstrings(module: object) -> None:
    done = doctest.testmod(module)  # type: ignore[arg-type]
    assert done.attempted > 0 and done.failed == 0


def test_the_farm_script_with_plain_processes() -> None:
    command = Path(sys.executable).parent / "steradian"
    scene = SCENES / "small-lamp.pbrt"
    farm = [
        subprocess.Popen(
            [command, "render", scene, "--passes", f"{2 * i}..{2 * i + 2}", "--partial", f"part-{i}.partial", "--quiet"]
        )
        for i in range(3)
    ]
    assert all(p.wait(60) == 0 for p in farm)
    parts = [f"part-{i}.partial" for i in (2, 0, 1)]
    subprocess.run([command, "merge", *parts, "-o", "all.partial"], check=True, capture_output=True)
    assert Path("all.partial").read_bytes() == sr.render(scene, spp=6).to_bytes()
