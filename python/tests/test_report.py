"""The report in a real browser: it opens without a network, slides, flips, and fits wide and narrow windows."""

import os
import shutil
from pathlib import Path

import pytest
from test_notebook import BROWSERS, FLAGS

import steradian as sr

PIXEL = """([x, y]) => {
  const stage = document.querySelector('#stage'), scale = stage.width / stage.clientWidth;
  return [...stage.getContext('2d').getImageData(x * scale, y * scale, 1, 1).data];
}"""


def test_the_report_in_a_browser(lamp: sr.Scene, tmp_path: Path) -> None:
    playwright = pytest.importorskip("playwright.sync_api", reason="the report's test needs playwright")
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        pytest.skip("the report's test needs a browser: apt-get install chromium")
    methods = {"path": "path", "depth 0": "path:max_depth=0"}
    how = {"resolution": (48, 32), "progress": False}
    compared = sr.compare(lamp, methods, spp=8, seeds=2, reference_time=2, cache=tmp_path, title="A & B", **how)
    compared.save(tmp_path / "report.html")
    pictures = Path(os.environ.get("STERADIAN_SCREENSHOTS", tmp_path))
    with playwright.sync_playwright() as p:
        chromium = p.chromium.launch(executable_path=browser, headless=True, args=FLAGS)
        context = chromium.new_context(viewport={"width": 1300, "height": 900}, offline=True)
        page = context.new_page()
        wrong: list[str] = []
        page.on("pageerror", lambda e: wrong.append(str(e)))
        page.on("console", lambda m: wrong.append(m.text) if m.type == "error" else None)
        page.on("request", lambda r: wrong.append(r.url) if not r.url.startswith(("file:", "data:", "blob:")) else None)
        page.goto((tmp_path / "report.html").as_uri())
        assert page.title() == "A & B – Steradian" and page.inner_text("h1") == "A & B"
        assert page.locator("#figures tr").count() == 3 and page.locator("figure svg").count() == 2

        # Left is the reference, right what a key chooses: depth 0 is dark where the reference is light.
        box = page.locator("#stage").bounding_box()
        middle = [box["width"] / 2, box["height"] / 2]
        right, left = [middle[0] + 40, middle[1]], [middle[0] - 40, middle[1]]
        page.keyboard.press("2")
        assert page.eval_on_selector("#right", "e => e.selectedOptions[0].textContent") == "depth 0"
        assert sum(page.evaluate(PIXEL, right)[:3]) < 30 < sum(page.evaluate(PIXEL, left)[:3])

        # The line follows the mouse, so that the right point shows the left picture.
        page.mouse.move(box["x"] + middle[0], box["y"] + middle[1])
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] * 0.9, box["y"] + middle[1], steps=5)
        page.mouse.up()
        assert sum(page.evaluate(PIXEL, right)[:3]) > 30

        # Space flips both.
        page.keyboard.press(" ")
        assert page.eval_on_selector("#left", "e => e.selectedOptions[0].textContent") == "depth 0"
        assert sum(page.evaluate(PIXEL, right)[:3]) < 30
        page.keyboard.press(" ")

        # Under the pointer: values with their intervals. Error maps and exposure draw something else.
        page.mouse.move(box["x"] + right[0], box["y"] + right[1])
        assert "±" in page.inner_text("#inspector")
        before = page.evaluate(PIXEL, right)
        page.select_option("#layer", "error")
        assert page.evaluate(PIXEL, right) != before and page.is_visible("#scale")
        page.select_option("#layer", "picture")
        page.fill("#exposure", "2")
        assert sum(page.evaluate(PIXEL, right)) > sum(before)

        for name, width in [("wide", 1300), ("narrow", 420)]:
            page.set_viewport_size({"width": width, "height": 900})
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            page.screenshot(path=pictures / f"report-{name}.png", full_page=True)
        assert wrong == []
        chromium.close()
