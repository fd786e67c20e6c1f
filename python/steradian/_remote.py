"""``steradian render --cluster`` in the Python half: reads a request from standard input, answers on standard output.

The line of JSON that comes first says what to render; when standard input closes after it, the render stops with what it has.
The film goes to the file that the request names; the answer, a line of JSON, tells about the work, or what went wrong.
"""

from __future__ import annotations

import json
import sys
import threading
import warnings
from pathlib import Path
from typing import Any, TextIO

from . import _native, cluster
from ._progress import bar
from ._scene import load
from .errors import FilmTooLargeError, ParameterError, ResumeError, SceneError, SceneWarning, SteradianError


def main() -> int:
    """Serves one request."""
    # What others print must not be taken for the answer.
    answers, sys.stdout = sys.stdout, sys.stderr
    try:
        answer = _serve(json.loads(sys.stdin.readline()))
    except SteradianError as e:
        wrong = isinstance(e, SceneError | ParameterError | ResumeError | FilmTooLargeError | cluster.ClusterError)
        answer = {"error": str(e), "input": wrong}
    print(json.dumps(answer), file=answers, flush=True)
    return 0


def _serve(request: dict[str, Any]) -> dict[str, Any]:
    if request["version"] != _native.__version__:
        raise cluster.ClusterError(
            f"the Python package is version {_native.__version__}, and this program {request['version']}: "
            "install the same of both"
        )
    warnings.showwarning = _show
    stop = threading.Event()

    def wait_for_the_end() -> None:
        sys.stdin.read()
        stop.set()

    threading.Thread(target=wait_for_the_end, daemon=True).start()
    scene = load(request["scene"], strict=request["strict"], defines=dict(request["defines"]))
    shown = bar(not request["quiet"])
    last: dict[str, Any] = {}

    def on_progress(event: dict[str, Any]) -> bool:
        shown.on(event)
        if event["event"] == "nodes":
            last["processors"] = event["processors"]
        return stop.is_set()

    same = ("integrator", "seed", "resolution", "crop", "spectral", "spp", "checkpoint", "checkpoint_every", "resume")
    how = {name: request[name] for name in same}
    for name in ("resolution", "crop"):
        how[name] = None if how[name] is None else tuple(how[name])
    passes = None if request["passes"] is None else tuple(request["passes"])
    try:
        image = cluster.render(
            scene,
            address=request["address"],
            passes=passes,
            progress=False,
            on_progress=on_progress,
            events=request["events"],
            **how,
            **dict(request["settings"]),
        )
    except KeyboardInterrupt:
        return {**_about(scene, {}, last), "rendered": False, "interrupted": True}
    finally:
        shown.end()
    image._film.save(Path(request["partial"]))
    return {**_about(scene, image._report, last), "rendered": True, "interrupted": image._report["interrupted"]}


def _about(scene: Any, report: dict[str, Any], last: dict[str, Any]) -> dict[str, Any]:
    numbers = ("passes_resumed", "retries", "load_seconds", "render_seconds", "rays", "camera_paths", "light_paths")
    return {
        "filename": scene.film.filename,
        "processors": last.get("processors", 0),
        "nodes": report.get("nodes", {}),
        **{name: report.get(name, 0) for name in numbers},
    }


def _show(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    text = str(message)
    if issubclass(category, SceneWarning) and "warning: " not in text:
        text = f"warning: {text}"
    print(text, file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
