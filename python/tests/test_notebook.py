"""Notebooks: the guide's, without a browser; and the live widget in JupyterLab, in a real one."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import ROOT, SCENES

import steradian as sr

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking"]
FLAGS += ["--disable-component-update", "--disable-sync"]


def test_the_guides_notebook() -> None:
    pytest.importorskip("nbclient", reason="notebooks need nbclient and ipykernel")
    pytest.importorskip("ipykernel", reason="notebooks need nbclient and ipykernel")
    pytest.importorskip("anywidget", reason="the live widget needs anywidget")
    import nbclient
    import nbformat

    notebook = nbformat.read(ROOT / "docs/guide/notebook.ipynb", as_version=4)
    folder = {"metadata": {"path": str(ROOT / "docs/guide")}}
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3", resources=folder).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    shown = [kind for output in outputs for kind in output.get("data", {})]
    assert "application/vnd.jupyter.widget-view+json" in shown
    assert shown.count("image/png") == 2 and "text/html" in shown
    assert not any(output.output_type == "error" for output in outputs)


def test_live_renders_have_the_bits_of_renders(lamp: sr.Scene) -> None:
    how = {"resolution": (24, 16), "integrator": "path"}
    live = sr.live(lamp, spp=30, every=0.01, **how)
    assert live.wait(60).to_bytes() == sr.render(lamp, spp=30, **how).to_bytes()
    assert not live.running and "done after 30 passes" in repr(live) and 0 < live.error < 1

    # What is seen in between is the render so far; stopping gives it.
    live = sr.live(lamp, time=60, every=0.01, **how)
    while live.image is None:
        time.sleep(0.01)
    seen = live.image
    assert live.running and seen.to_bytes() == sr.render(lamp, spp=seen.spp, **how).to_bytes()
    with pytest.raises(TimeoutError):
        live.wait(0.01)
    live.stop()
    image = live.wait(60)
    assert image.spp >= seen.spp and image.metadata["interrupted"] and "stopped after" in repr(live)

    live = sr.live(lamp, integrator="pth")
    with pytest.raises(sr.ParameterError, match="there is no integrator `pth`"):
        live.wait(60)


def test_a_live_render_does_not_keep_python_from_ending() -> None:
    code = f"import steradian as sr; sr.live({str(SCENES / 'small-lamp.pbrt')!r}, time=600)"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[str]:
    """A JupyterLab of its own, with a notebook that shows a live render."""
    pytest.importorskip("jupyterlab", reason="the widget's test needs jupyterlab")
    pytest.importorskip("anywidget", reason="the live widget needs anywidget")
    scene = str(SCENES / "small-lamp.pbrt")
    source = [
        "import steradian as sr",
        f"live = sr.live({scene!r}, time=120, resolution=(320, 200), integrator='path')",
        "live",
    ]
    cell = {"cell_type": "code", "id": "a", "metadata": {}, "execution_count": None, "outputs": [], "source": "\n".join(source)}
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    notebook = {"cells": [cell], "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    (tmp_path / "live.ipynb").write_text(json.dumps(notebook))
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        port = s.getsockname()[1]
    options = ["--allow-root", "--no-browser", f"--port={port}", "--IdentityProvider.token=", "--expose-app-in-browser"]
    home = {f"JUPYTER_{kind}_DIR": str(tmp_path / kind) for kind in ("CONFIG", "RUNTIME")}
    server = subprocess.Popen(
        [sys.executable, "-m", "jupyterlab", *options, f"--ServerApp.root_dir={tmp_path}"],
        env={**os.environ, **home, "JUPYTERLAB_SETTINGS_DIR": str(tmp_path / "s"), "JUPYTERLAB_WORKSPACES_DIR": str(tmp_path / "w")},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        address = f"http://127.0.0.1:{port}"
        for _ in range(600):
            try:
                urllib.request.urlopen(f"{address}/api", timeout=5).close()
                break
            except OSError:
                assert server.poll() is None, "JupyterLab ended"
                time.sleep(0.1)
        yield f"{address}/lab/tree/live.ipynb"
    finally:
        server.send_signal(signal.SIGTERM)
        server.wait(30)


def test_the_live_widget_in_a_browser(lab: str, tmp_path: Path) -> None:
    playwright = pytest.importorskip("playwright.sync_api", reason="the widget's test needs playwright")
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        pytest.skip("the widget's test needs a browser: apt-get install chromium")
    pictures = Path(os.environ.get("STERADIAN_SCREENSHOTS", tmp_path))
    with playwright.sync_playwright() as p:
        chromium = p.chromium.launch(executable_path=browser, headless=True, args=FLAGS)
        page = chromium.new_page(viewport={"width": 1000, "height": 700})
        page.goto(lab, timeout=120_000, wait_until="domcontentloaded")
        page.wait_for_selector(".jp-NotebookPanel .jp-Cell", timeout=120_000)
        kernel = "window.jupyterapp?.shell.currentWidget?.sessionContext?.session?.kernel"
        page.wait_for_function(f"{kernel}?.status === 'idle'", timeout=120_000)
        page.evaluate("void jupyterapp.commands.execute('notebook:run-all-cells')")

        # The image grows sharper while the kernel is free: another error, other pixels.
        page.wait_for_selector(".steradian-image[src^='blob:']", timeout=120_000)
        page.wait_for_function("document.querySelector('.steradian-error').textContent.match(/error [0-9]/)", timeout=60_000)
        first = page.inner_text(".steradian-error")
        image = page.eval_on_selector(".steradian-image", "e => [e.src, e.naturalWidth, e.naturalHeight]")
        assert image[1:] == [320, 200]
        page.wait_for_function(f"document.querySelector('.steradian-error').textContent !== {first!r}", timeout=60_000)
        page.wait_for_function(f"document.querySelector('.steradian-image').src !== {image[0]!r}", timeout=60_000)
        assert "passes" in page.inner_text(".steradian-text")
        page.screenshot(path=pictures / "live-running.png")

        # The button ends it.
        page.click(".steradian-stop")
        page.wait_for_selector(".steradian-over", timeout=60_000)
        assert page.inner_text(".steradian-text").startswith("stopped after")
        assert page.is_disabled(".steradian-stop")
        page.set_viewport_size({"width": 480, "height": 700})
        page.screenshot(path=pictures / "live-stopped-narrow.png")
        chromium.close()
