"""A cluster on this machine: the bits of one thread, whatever dies."""

import json
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from conftest import SCENES

import steradian as sr

ray = pytest.importorskip("ray")
cluster_utils = pytest.importorskip("ray.cluster_utils")

SMALL = {"resolution": (24, 24), "seed": 2}


@pytest.fixture(scope="module")
def nodes() -> Any:
    """A head without processors, and three nodes with one each."""
    cluster = cluster_utils.Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    workers = [cluster.add_node(num_cpus=1) for _ in range(3)]
    ray.init(address=cluster.address, log_to_driver=False)
    cluster.wait_for_nodes()
    yield cluster, workers
    ray.shutdown()
    cluster.shutdown()


def test_a_node_dies_and_another_joins_and_the_bits_are_the_same(nodes: Any) -> None:
    cluster, workers = nodes
    scene = sr.load(SCENES / "small-lamp.pbrt")
    killed: list[str] = []

    def on_progress(event: dict[str, Any]) -> None:
        if not killed and event["fraction"] > 0.1:
            killed.append(workers[0].node_id)
            threading.Thread(target=lambda: cluster.remove_node(workers[0], allow_graceful=False)).start()
            cluster.add_node(num_cpus=1)

    expected = sr.render(scene, integrator="path", spp=600, threads=1, **SMALL)
    image = sr.cluster.render(
        scene, integrator="path", spp=600, passes_per_task=20, on_progress=on_progress, events="events.jsonl", **SMALL
    )
    assert killed
    assert image.to_bytes() == expected.to_bytes()
    about = image.metadata
    assert len(about["nodes"]) >= 2 and sum(about["nodes"].values()) == 600 and about["retries"] >= 0
    lines = [json.loads(line) for line in Path("events.jsonl").read_text().splitlines()]
    assert len(lines) == 30 and lines[-1]["fraction"] == 1.0

    # Methods that splat and methods with memory.
    for integrator in ["light", "mlt"]:
        one = sr.render(scene, integrator=integrator, spp=8, threads=1, **SMALL)
        many = sr.cluster.render(scene, integrator=integrator, spp=8, passes_per_task=2, **SMALL)
        assert many.to_bytes() == one.to_bytes(), integrator

    # Errors of the workers are the driver's.
    with pytest.raises(sr.ParameterError, match="there is no integrator `pth`"):
        sr.cluster.render(scene, integrator="pth", spp=2)
    with pytest.raises(sr.ParameterError, match="has no time"):
        sr.cluster.render(scene, time=3)

    # Stopped, it gives what there is.
    stopped = sr.cluster.render(scene, spp=64, passes_per_task=1, on_progress=lambda e: True, **SMALL)
    assert stopped.metadata["interrupted"] and 1 <= stopped.spp < 64

    # Batches go on where they ended.
    jobs = [{"seed": i} for i in range(3)]
    Path("out").mkdir()
    Path("out/0001.pfm").write_text("there already")
    how = {"scene": scene, "spp": 2, "resolution": (8, 8), "name": "{:04}.pfm".format}
    paths = sr.cluster.render_many(jobs, "out", **how)
    assert all(p.exists() for p in paths) and paths[1].read_text() == "there already"
    assert (sr.read(paths[2]) == sr.render(scene, spp=2, resolution=(8, 8), seed=2).array).all()
    time.sleep(0)
