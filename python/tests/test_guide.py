"""The guide's examples, and those in docstrings, do what they say."""

import doctest
import os
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
    guide = (ROOT / "docs/guide/farms.md").read_text()
    Path("render.sh").write_text(guide.split("```sh\n")[1].split("```")[0])
    programs = Path(sys.executable).parent
    shared = {**os.environ, "PATH": f"{programs}:{os.environ['PATH']}", "PASSES_PER_TASK": "2"}
    shared["SCENE"] = str(SCENES / "small-lamp.pbrt")

    def array(tasks: list[int]) -> list[int]:
        started = [
            subprocess.Popen(["sh", "render.sh"], env={**shared, "SLURM_ARRAY_TASK_ID": str(i)}) for i in tasks
        ]
        return [p.wait(60) for p in started]

    assert array([0, 1, 2]) == [0, 0, 0]
    assert array([1]) == [0], "a requeued task"
    parts = [f"part-{i}.partial" for i in (2, 0, 1)]
    command = programs / "steradian"
    subprocess.run([command, "merge", *parts, "-o", "all.partial"], check=True, capture_output=True)
    assert Path("all.partial").read_bytes() == sr.render(scene := SCENES / "small-lamp.pbrt", spp=6).to_bytes()
    twice = subprocess.run([command, "merge", *parts, parts[0], "-o", "x.exr"], capture_output=True, text=True)
    assert twice.returncode == 0 and "is not added again" in twice.stderr
    sr.render(scene, passes=(6, 8), seed=9).save("other.partial")
    other = subprocess.run([command, "merge", *parts, "other.partial", "-o", "x.exr"], capture_output=True, text=True)
    assert other.returncode == 2 and "other.partial cannot be merged with the others: " in other.stderr
    assert "seeds" in other.stderr
