"""Scenes and pictures that the tests share."""

from pathlib import Path

import pytest

import steradian as sr

ROOT = Path(__file__).parents[2]
SCENES = ROOT / "tests" / "scenes"


@pytest.fixture(scope="session")
def lamp() -> sr.Scene:
    """A floor under a small lamp: 16x16 renders of it take milliseconds."""
    return sr.load(SCENES / "small-lamp.pbrt")


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A test that writes leaves nothing behind."""
    monkeypatch.chdir(tmp_path)
