"""Progress bars: in a terminal, in a notebook, or none."""

from __future__ import annotations

import importlib
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

Event = dict[str, Any]
Listener = Callable[[Event], "bool | None"]


def clock(seconds: float) -> str:
    """A time for people: ``12 s``, ``3 min 07 s``, ``2 h 05 min``."""
    s = int(seconds)
    if s < 60:
        return f"{s} s"
    if s < 3600:
        return f"{s // 60} min {s % 60:02} s"
    return f"{s // 3600} h {s // 60 % 60:02} min"


def sentence(event: Event) -> str:
    """How far a render is, in a line."""
    of = f" of {event['of_passes']}" if event["of_passes"] is not None else ""
    rate = event["rays"] / max(event["elapsed_seconds"], 1e-9) * 1e-6
    left = event["remaining_seconds"]
    return (
        f"{event['passes']}{of} passes  {rate:.1f} Mrays/s"
        + (f"  {clock(left)} left" if left is not None else "")
    )


class Silent:
    """Shows nothing."""

    #: What is on now, where a call has several renders.
    _step = ""

    def on(self, event: Event) -> None:
        """Hears an event."""

    def _hear_step(self, event: Event) -> None:
        if event["event"] == "step":
            run = f"run {event['number']} of {event['of']}: " if event["number"] else ""
            self._step = f"{run}{event['label']}  "

    def end(self) -> None:
        """The render is over."""


class Terminal(Silent):
    """A bar on standard error, for renders that take longer than half a second."""

    def __init__(self) -> None:
        self._since = time.monotonic()
        self._shown = False

    def on(self, event: Event) -> None:
        """Draws the bar anew."""
        self._hear_step(event)
        if event["event"] == "warning":
            self._clear()
            print(f"warning: {event['message']}", file=sys.stderr)
        if event["event"] != "progress" or time.monotonic() - self._since < 0.5:
            return
        try:
            columns = os.get_terminal_size(sys.stderr.fileno()).columns
        except (OSError, ValueError):
            columns = 80
        text = f" {100 * event['fraction']:3.0f} %  {self._step}{sentence(event)}"
        width = max(columns - len(text) - 1, 8)
        done = round(width * event["fraction"])
        sys.stderr.write("\r" + "━" * done + "╌" * (width - done) + text[: columns - width - 1] + "\x1b[K")
        sys.stderr.flush()
        self._shown = True

    def end(self) -> None:
        """Takes the bar away."""
        self._clear()

    def _clear(self) -> None:
        if self._shown:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()
            self._shown = False


class Notebook(Silent):
    """A bar under a notebook's cell."""

    def __init__(self) -> None:
        shown: Any = importlib.import_module("IPython.display")
        self._html = shown.HTML
        self._handle = shown.display(shown.HTML(""), display_id=True)
        self._told = 0.0

    def on(self, event: Event) -> None:
        """Draws the bar anew, at most four times a second."""
        self._hear_step(event)
        now = time.monotonic()
        if event["event"] != "progress" or now - self._told < 0.25:
            return
        self._told = now
        text = f"{100 * event['fraction']:.0f} % &nbsp; {escape(self._step)}{sentence(event)}"
        self._update(f"<progress value='{event['fraction']:.3f}' max='1' style='width:20em'></progress> {text}")

    def end(self) -> None:
        """Takes the bar away."""
        self._update("")

    def _update(self, html: str) -> None:
        if self._handle is not None:
            self._handle.update(self._html(html))


def bar(wanted: bool) -> Silent:
    """The bar that fits where we are; nothing in a pipe."""
    if not wanted:
        return Silent()
    if _in_notebook():
        return Notebook()
    if sys.stderr is not None and sys.stderr.isatty():
        return Terminal()
    return Silent()


@contextmanager
def heard(wanted: bool, on_progress: Listener | None) -> Iterator[Listener | None]:
    """Who hears a call's events: the bar and `on_progress`. None if nobody does: then the call never waits for the
    interpreter, but for a look at Ctrl-C."""
    shown = bar(wanted)

    def listener(event: Event) -> bool | None:
        shown.on(event)
        return on_progress(event) if on_progress is not None else None

    try:
        yield listener if on_progress is not None or type(shown) is not Silent else None
    finally:
        shown.end()


def _in_notebook() -> bool:
    ipython = sys.modules.get("IPython")
    if ipython is None:
        return False
    shell = ipython.get_ipython()
    return shell is not None and shell.has_trait("kernel")
