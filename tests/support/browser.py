"""Pages in a real browser: Chromium without a window, what it says on its console, and what is seen."""

import io
import os
import shutil
from contextlib import contextmanager

import numpy as np
import pytest

# Without a sandbox for containers, without a graphics card, and without the connections that Chromium makes for itself.
FLAGS = (
    "--no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking --disable-component-update --disable-sync"
).split()


@contextmanager
def chromium():
    """The browser, or a skipped test where it or playwright is missing. CHROMIUM in the environment names another program."""
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright: pip install 'pycraft-soa[browser]'")
    program = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("needs Chromium: apt install chromium, or name yours in the environment's CHROMIUM")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=program, args=FLAGS)
        try:
            yield opened
        finally:
            opened.close()


@contextmanager
def opened(browser, address, *, dark=False, size=(1100, 700)):
    """A page at an address, which must not complain; `page.asked` is all that it asked for."""
    page = browser.new_page(viewport={"width": size[0], "height": size[1]}, color_scheme="dark" if dark else "light")
    complaints, page.asked = [], []
    page.on("console", lambda message: complaints.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    page.goto(address)
    try:
        yield page
    finally:
        page.close()
    assert complaints == []


def pixels(page, selector="#figure"):
    """Return the picture of a part of the page, (height, width, 3)."""
    from matplotlib.image import imread

    return imread(io.BytesIO(page.locator(selector).screenshot()), format="png")[..., :3]


def differing(a, b):
    """Pixels that differ by more than a tenth."""
    return int((np.abs(a - b).max(axis=-1) > 0.1).sum())


def until(page, condition, seconds=10.0):
    """Waits for a condition in JavaScript: the pages' policy lets playwright's own way evaluate nothing."""
    for _ in range(int(seconds / 0.05)):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"not within {seconds:g} s: {condition}")
