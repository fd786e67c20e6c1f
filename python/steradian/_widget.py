"""The widget that shows a `Live` in a notebook."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import anywidget
import traitlets

if TYPE_CHECKING:
    from ._image import Image
    from ._live import Live

#: The widget is told no more often, in seconds.
_PAUSE = 0.1


class LiveWidget(anywidget.AnyWidget):
    """Image, error estimate, progress and a stop button. What it shows comes from `Live`, what is clicked goes there."""

    _esm = Path(__file__).parent / "widget.js"
    _css = Path(__file__).parent / "widget.css"

    #: The image as a PNG file, tone-mapped.
    png = traitlets.Bytes(b"").tag(sync=True)
    size = traitlets.List([0, 0]).tag(sync=True)
    #: How far it is, in a line.
    text = traitlets.Unicode("").tag(sync=True)
    #: The error estimate in words.
    error = traitlets.Unicode("").tag(sync=True)
    fraction = traitlets.Float(0.0).tag(sync=True)
    running = traitlets.Bool(True).tag(sync=True)
    #: Set by the button.
    stop_wanted = traitlets.Bool(False).tag(sync=True)

    def __init__(self, **traits: Any) -> None:
        super().__init__(**traits)
        self._shown: Image | None = None
        self._told = 0.0

    def show(self, live: Live) -> None:
        """Shows how far a render is; only the thread that draws may call it."""
        pause = _PAUSE - (time.monotonic() - self._told)
        if live.running and pause > 0:
            time.sleep(pause)
        image, running = live.image, live.running
        self._told = time.monotonic()
        with self.hold_sync():
            self.text, self.fraction, self.running = live._text, live._fraction, running
            if image is None and live._sketch is not None:
                self.png, self.size = live._sketch[0], list(live._sketch[1])
            elif image is not None and image is not self._shown:
                self._shown = image
                height, width, _ = image.shape
                self.png, self.size, self.error = image.to_png(filmic=True), [width, height], error_in_words(live.error)


def error_in_words(error: float) -> str:
    """``error 3.2 %``"""
    return f"error {100 * error:.2g} %" if math.isfinite(error) else "error unknown"
