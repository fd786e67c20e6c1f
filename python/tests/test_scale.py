"""What the document says of large clusters is what the simulation says."""

import importlib.util
import sys
from types import ModuleType

import pytest
from conftest import ROOT


@pytest.fixture(scope="module")
def simulate() -> ModuleType:
    """`docs/scale/simulate.py`."""
    spec = importlib.util.spec_from_file_location("simulate", ROOT / "docs/scale/simulate.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["simulate"] = module
    spec.loader.exec_module(module)
    return module


def test_the_documents_tables_are_those_of_the_simulation(simulate: ModuleType) -> None:
    assert simulate.document() == simulate.DOCUMENT.read_text(), "run docs/scale/simulate.py --write"


def test_the_simulation_keeps_the_books(simulate: ModuleType) -> None:
    job = simulate.Job("small", 1_000_000, 960, 20.0, 0.0, 0.0)
    times = []
    for nodes in [1, 2, 4, 100]:
        s = simulate.Simulation(simulate.Cluster(nodes), job)
        times.append(s.run() - s.first_start)
        assert s.done == job.passes and s.flying == 0 and not s.running
        work = job.pixels * job.microseconds * 1e-6 * job.passes
        assert times[-1] >= 0.95 * work / (16 * nodes), "nobody is faster than all processors"
    assert times[0] > 1.8 * times[1] > 3.2 * times[2] > times[3], "and more of them are"
    lost = simulate.Simulation(simulate.Cluster(4), job, lose_at=40.0)
    assert lost.run() - lost.first_start > times[2] and lost.done == job.passes and lost.lost_passes > 0
