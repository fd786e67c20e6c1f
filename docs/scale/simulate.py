"""A render on many nodes, event by event: what `docs/scale.md` says of 10, 100 and 1000 nodes comes from here.

    python docs/scale/simulate.py [--write]      prints the tables, or writes them into docs/scale.md: the same on every machine

The driver's rules (how long tasks are, how many are on their way, how films are merged) are the driver's own, from
`steradian._farm`; what things cost is measured (`measured.json`, by `benches/cluster.py figures`) or assumed (`ASSUMED`).
"""

from __future__ import annotations

import heapq
import json
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from steradian._farm import chunk, tree

MEASURED: dict[str, Any] = json.loads((Path(__file__).parent / "measured.json").read_text())
ASSUMED = {
    "link_gb_per_second": 1.25,  # 10 Gbit/s, of each node and of the driver, in each direction
    "worker_start_seconds": 3.0,  # Python, imports
    "noise": 0.2,  # tasks of one length take up to so much longer or shorter, by their place in the picture's passes
    "notice_seconds": 10.0,  # until the loss of a node is known
    "threads_efficiency": 0.95,  # of the threads of a task
}


@dataclass(frozen=True)
class Job:
    """A render."""

    name: str
    pixels: int
    passes: int
    microseconds: float
    """Of one thread for a pixel and pass."""
    scene_gb: float
    compile_seconds: float


@dataclass(frozen=True)
class Cluster:
    """Nodes with as many processors each."""

    nodes: int
    cores: int = 16


JOBS = [
    Job("preview 640 x 360", 640 * 360, 256, 25.0, 0.05, 1.0),
    Job("still 1920 x 1080", 1920 * 1080, 4096, 25.0, 0.5, 10.0),
    Job("poster 7680 x 4320", 7680 * 4320, 16384, 25.0, 5.0, 60.0),
]
NODES = [1, 10, 100, 1000]


def spread(cluster: Cluster, job: Job) -> float:
    """Seconds until the last node has the scene: who has it gives it on, so that their number doubles."""
    rounds = math.ceil(math.log2(cluster.nodes + 1))
    return rounds * job.scene_gb / ASSUMED["link_gb_per_second"]


class Simulation:
    """One render; `lose_at` is when a node dies."""

    def __init__(self, cluster: Cluster, job: Job, lose_at: float | None = None) -> None:
        self.cluster, self.job = cluster, job
        total = cluster.nodes * cluster.cores
        self.threads = min(cluster.cores, max(1, -(-2 * total // job.passes)))
        self.slots = max(1, cluster.nodes * (cluster.cores // self.threads))
        self.fan_in, self.levels = tree(self.slots)
        self.film_gb = MEASURED["film_bytes_per_pixel"]["path"] * job.pixels * 1e-9
        self.packing = self.film_gb * MEASURED["film_pack_seconds_per_gb"]
        speed = self.threads * (ASSUMED["threads_efficiency"] if self.threads > 1 else 1.0)
        self.per_pass = job.pixels * job.microseconds * 1e-6 / speed
        self.left, self.per_pass_known = job.passes, 0.0
        self.n_tasks = self.n_results = self.flying = self.queued = 0
        self.driver_free = self.driver_busy = self.link_free = self.link_busy = self.now = 0.0
        self.events: list[tuple[float, int, Callable[[], None]]] = []
        self.order = 0
        self.idle: list[int] = []
        self.waiting: list[int] = []
        self.kept: list[list[tuple[int, float]]] = [[] for _ in range(self.levels + 1)]
        self.done = self.merging = 0
        self.lose_at, self.lost_passes, self.running = lose_at, 0, dict[int, int]()
        self.first_start = spread(cluster, job) + ASSUMED["worker_start_seconds"] + job.compile_seconds

    def at(self, time: float, do: Callable[[], None]) -> None:
        """Something will happen."""
        self.order += 1
        heapq.heappush(self.events, (time, self.order, do))

    def run(self) -> float:
        """Seconds until the picture is there."""
        for slot in range(self.slots):
            # Nodes get the scene one after the other.
            node = slot * self.cluster.nodes // self.slots
            share = (math.ceil(math.log2(node + 2))) / math.ceil(math.log2(self.cluster.nodes + 1))
            start = self.first_start - spread(self.cluster, self.job) * (1 - share)
            self.at(start, lambda slot=slot: self.free(slot))
        if self.lose_at is not None:
            self.at(self.lose_at, self.lose)
        self.submit()
        while self.events:
            self.now, _, do = heapq.heappop(self.events)
            do()
        return self.now

    def submit(self) -> None:
        """The driver keeps twice as many tasks on their way as run at a time."""
        while self.flying < 2 * self.slots and self.left > 0:
            n = min(self.left, chunk(self.job.passes, self.left, self.slots, self.per_pass_known, self.packing))
            self.left -= n
            self.flying += 1
            self.n_tasks += 1
            self.waiting.append(n)
        while self.waiting and self.idle:
            self.start(self.idle.pop(), self.waiting.pop(0))

    def free(self, slot: int) -> None:
        """A processor has nothing to do."""
        if self.waiting:
            self.start(slot, self.waiting.pop(0))
        else:
            self.idle.append(slot)

    def start(self, slot: int, n: int) -> None:
        """A task begins."""
        self.order += 1
        noise = 1.0 + ASSUMED["noise"] * (2.0 * ((self.order * 0.6180339887498949) % 1.0) - 1.0)
        self.running[slot] = n
        self.at(self.now + n * self.per_pass * noise + self.packing, lambda: self.end(slot, n))

    def end(self, slot: int, n: int) -> None:
        """A task ends: its film waits for the driver, or for a task that merges it with others."""
        if self.running.get(slot) != n:
            return  # It was on a node that died.
        del self.running[slot]
        self.per_pass_known = self.per_pass
        if self.levels == 0:
            self.to_driver(n)
        else:
            # The driver hears of the end at once, the film stays where it is.
            self.flying -= 1
            self.keep(0, n)
            self.submit()
        self.free(slot)

    def keep(self, level: int, n: int) -> None:
        """A film waits to be merged with others of its level."""
        self.kept[level].append((n, self.now))
        some = self.kept[level]
        last = self.left == 0 and not self.running and not self.waiting
        if len(some) >= self.fan_in or (last and self.merging == 0):
            if last:
                some = [film for of_level in self.kept for film in of_level]
                self.kept = [[] for _ in range(self.levels + 1)]
            for i in range(0, len(some), self.fan_in):
                group = some[i : i + self.fan_in]
                moved = (len(group) - 1) * self.film_gb / ASSUMED["link_gb_per_second"]
                added = len(group) * self.film_gb * MEASURED["film_add_seconds_per_gb"] + self.packing
                passes, to = sum(n for n, _ in group), self.levels if last else level + 1
                self.merging += 1
                self.at(self.now + moved + added, lambda passes=passes, to=to: self.merged(passes, to))
            if not last:
                self.kept[level] = []

    def merged(self, passes: int, level: int) -> None:
        """A task has merged films."""
        self.merging -= 1
        if level < self.levels:
            self.keep(level, passes)
        else:
            self.to_driver(passes)

    def to_driver(self, n: int) -> None:
        """A film goes to the driver, which adds it."""
        moving = self.film_gb / ASSUMED["link_gb_per_second"]
        self.link_free = max(self.link_free, self.now) + moving
        self.link_busy += moving
        adding = self.film_gb * MEASURED["film_add_seconds_per_gb"] + MEASURED["task_driver_milliseconds"] * 1e-3
        self.driver_free = max(self.driver_free, self.link_free) + adding
        self.driver_busy += adding
        self.n_results += 1
        self.at(self.driver_free, lambda: self.added(n))

    def added(self, n: int) -> None:
        """The driver has a film more."""
        self.done += n
        if self.levels == 0:
            self.flying -= 1
            self.submit()
        elif self.merging == 0 and any(self.kept) and self.left == 0 and not self.running and not self.waiting:
            self.flush()

    def flush(self) -> None:
        """What is left is merged at once."""
        level = next(i for i, films in enumerate(self.kept) if films)
        n, _ = self.kept[level].pop()
        self.keep(level, n)

    def lose(self) -> None:
        """The first node dies: what it was at begins again elsewhere, once that is known."""
        mine = [s for s in self.running if s * self.cluster.nodes // self.slots == 0]
        lost = [self.running.pop(s) for s in mine]
        self.idle = [s for s in self.idle if s * self.cluster.nodes // self.slots != 0]
        self.lost_passes = sum(lost)

        def known() -> None:
            self.left += sum(lost)
            self.flying -= len(lost)
            self.submit()

        self.at(self.now + ASSUMED["notice_seconds"], known)


def row(cluster: Cluster, job: Job) -> list[str]:
    """What a render takes."""
    s = Simulation(cluster, job)
    wall = s.run()
    assert s.done == job.passes, (s.done, job.passes)
    work = job.pixels * job.microseconds * 1e-6 * job.passes
    ideal = work / (cluster.nodes * cluster.cores)
    with_loss = wall
    if cluster.nodes > 1:
        lost = Simulation(cluster, job, lose_at=s.first_start + 0.5 * (wall - s.first_start))
        with_loss = lost.run()
        assert lost.done == job.passes, (lost.done, job.passes)
    return [
        str(cluster.nodes),
        f"{s.threads}",
        f"{s.n_tasks}",
        time(wall),
        time(ideal),
        f"{100 * ideal / wall:.0f} %",
        time(s.first_start),
        f"{s.n_results * s.film_gb:.1f} GB",
        f"{100 * s.driver_busy / wall:.0f} %",
        f"{100 * s.link_busy / wall:.0f} %",
        f"{with_loss - wall:+.1f} s" if cluster.nodes > 1 else "–",
    ]


def time(seconds: float) -> str:
    """For people."""
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.1f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


HEAD = [
    "nodes", "threads a task", "tasks", "time", "work / processors", "efficiency", "until the last node begins",
    "films to the driver", "driver busy", "its link busy", "a node lost half way",
]  # fmt: skip


def tables() -> str:
    """All tables, as Markdown."""
    parts = []
    for job in JOBS:
        film = MEASURED["film_bytes_per_pixel"]["path"] * job.pixels
        work = job.pixels * job.microseconds * 1e-6 * job.passes
        parts.append(
            f"**{job.name}**, {job.passes} passes: {time(work)} of one processor, a film of {film * 1e-6:.0f} MB, a scene of "
            f"{job.scene_gb:g} GB that compiles in {job.compile_seconds:.0f} s\n\n"
            f"| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}\n"
            + "\n".join(f"| {' | '.join(row(Cluster(n), job))} |" for n in NODES)
        )
    return "\n\n".join(parts) + "\n"


DOCUMENT = Path(__file__).parents[1] / "scale.md"
MARKS = ("<!-- tables: written by docs/scale/simulate.py -->\n", "<!-- end of tables -->\n")


def document() -> str:
    """`docs/scale.md` with the tables of today."""
    before, rest = DOCUMENT.read_text().split(MARKS[0])
    return before + MARKS[0] + "\n" + tables() + "\n" + MARKS[1] + rest.split(MARKS[1])[1]


if __name__ == "__main__":
    if "--write" in sys.argv:
        DOCUMENT.write_text(document())
    else:
        print(tables(), end="")
