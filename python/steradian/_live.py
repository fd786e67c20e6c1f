"""Renders in the background, and what shows them in a notebook."""

from __future__ import annotations

import atexit
import math
import threading
import weakref
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from . import _native, _progress
from ._image import Image

if TYPE_CHECKING:
    from ._scene import Scene
    from ._widget import LiveWidget

#: Renders that run; the end of Python stops them.
_running: weakref.WeakSet[Live] = weakref.WeakSet()


class Live:
    """A render that goes on in the background. Two threads serve it: one renders, one draws; neither waits for the other."""

    def __init__(self, scene: Scene, request: Mapping[str, Any]) -> None:
        self._scene, self._request = scene, dict(request)
        self._image: Image | None = None
        # Before there is an image: a small PNG file and the size that it stands for.
        self._sketch: tuple[bytes, tuple[int, int]] | None = None
        self._raised: BaseException | None = None
        self._stop = False
        self._text = "begins"
        self._fraction = 0.0
        self._widget: LiveWidget | None = None
        # Tells the drawing thread that there is something new.
        self._news = threading.Condition()
        self._version = 0
        self._thread = threading.Thread(target=self._render, name="steradian", daemon=True)
        self._painter = threading.Thread(target=self._paint, name="steradian-paint", daemon=True)
        _running.add(self)
        self._thread.start()
        self._painter.start()

    @property
    def image(self) -> Image | None:
        """What there is by now; None before the first pass."""
        return self._image

    @property
    def running(self) -> bool:
        """Does it still render?"""
        return self._thread.is_alive()

    @property
    def error(self) -> float:
        """The estimated error √relMSE of what there is; infinite below two passes."""
        image = self._image
        return math.inf if image is None else math.sqrt(image.metadata["relmse_estimate"])

    def stop(self) -> None:
        """Asks the render to end with what it has. Returns at once."""
        self._stop = True

    def wait(self, timeout: float | None = None) -> Image:
        """Waits for the end, at most `timeout` seconds (then TimeoutError), and gives the image. Raises what the render raised."""
        self._thread.join(timeout)
        if self._thread.is_alive():
            raise TimeoutError("the render goes on")
        self._painter.join(10)
        if self._raised is not None:
            raise self._raised
        assert self._image is not None
        return self._image

    @property
    def widget(self) -> LiveWidget:
        """The notebook's widget: an anywidget. ImportError says what to install."""
        if self._widget is None:
            try:
                from ._widget import LiveWidget
            except ImportError as e:
                raise ImportError(f"the live widget needs anywidget: pip install 'steradian[notebook]' ({e})") from None
            self._widget = LiveWidget()
            self._widget.observe(lambda _: self.stop(), "stop_wanted")
            self._tell()
            if not self._painter.is_alive():
                self._draw()
        return self._widget

    def _repr_mimebundle_(self, **options: Any) -> Any:
        return self.widget._repr_mimebundle_(**options)

    def __repr__(self) -> str:
        return f"<steradian.Live, {self._text}>"

    def _render(self) -> None:
        try:
            film, report = _native.render(self._scene._native, self._request, None, self._hear)
            self._image = Image(film, report, self._scene, self._request)
            self._fraction = 1.0
            self._text = f"{'stopped' if report['interrupted'] else 'done'} after {self._image.spp} passes"
        except BaseException as e:  # noqa: BLE001 (raised again where somebody waits)
            self._raised = e
            self._text = f"failed: {e}"
        finally:
            _running.discard(self)
            self._tell()

    def _hear(self, event: dict[str, Any]) -> bool:
        """On the thread that watches the render: as short as can be."""
        if event["event"] == "sketch":
            self._sketch = event["png"], event["size"]
            self._tell()
        elif event["event"] == "film":
            self._image = Image(event["film"], {}, self._scene, self._request)
            self._tell()
        elif event["event"] == "progress":
            self._text, self._fraction = _progress.sentence(event), event["fraction"]
            self._tell()
        return self._stop

    def _tell(self) -> None:
        with self._news:
            self._version += 1
            self._news.notify_all()

    def _paint(self) -> None:
        """Draws what is new, at most some times a second, till the render has ended and the end is drawn."""
        drawn = 0
        while True:
            with self._news:
                self._news.wait_for(lambda: self._version != drawn or not self._thread.is_alive(), 0.5)
                drawn, over = self._version, not self._thread.is_alive()
            self._draw()
            if over:
                return

    def _draw(self) -> None:
        if self._widget is not None:
            self._widget.show(self)


def _stop_all() -> None:
    """Python ends: no thread may wait for it any more."""
    for live in list(_running):
        live.stop()
        live._thread.join(60)


atexit.register(_stop_all)
