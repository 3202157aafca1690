"""A site in a real browser: served, shown as on a desktop or a phone, and measured."""

from __future__ import annotations

import functools
import http.server
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address where a plain web server shows a folder."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def show(
    browser: Any, *, width: int = 1280, height: int = 900, scheme: str = "light", media: str = ""
) -> None:
    """Let the browser be that wide, with that colour scheme."""
    phone = width < 600
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": media, "features": features})


def find(browser: Any, selector: str) -> Any:
    """The first element that a selector names."""
    return browser.find_element("css selector", selector)


def sideways(browser: Any) -> tuple[list[int], list[str]]:
    """How wide window and page are, and what reaches over the right edge with no frame that scrolls."""
    wide = browser.execute_script(
        "return [...document.querySelectorAll('main *')].filter(each => each.getBoundingClientRect().right "
        "> innerWidth + 1"
        " && !each.closest('.scroll, .model, pre, .hidden')).map(each => each.outerHTML.slice(0, 80))"
    )
    return browser.execute_script("return [innerWidth, document.documentElement.scrollWidth]"), wide


CONTRAST = """
const channel = x => (x /= 255) <= .04045 ? x / 12.92 : ((x + .055) / 1.055) ** 2.4;
const parse = text => text.match(/[\\d.]+/g).map(Number);
const light = ([r, g, b]) => .2126 * channel(r) + .7152 * channel(g) + .0722 * channel(b);
const behind = each => { for (; each; each = each.parentElement) {
  const colour = parse(getComputedStyle(each).backgroundColor);
  if (colour.length === 3 || colour[3] === 1) return colour; } return [255, 255, 255]; };
const found = [];
for (const each of document.querySelectorAll('body *')) {
  if (![...each.childNodes].some(node => node.nodeType === 3 && node.data.trim())) continue;
  if (!each.getClientRects().length) continue;
  const [a, b] = [light(parse(getComputedStyle(each).color)), light(behind(each))];
  found.push([(Math.max(a, b) + .05) / (Math.min(a, b) + .05), each.outerHTML.slice(0, 80)]);
}
return found.sort((a, b) => a[0] - b[0]);
"""
"""Contrast of every text that is seen, with the text, the weakest first."""


def check_legibility(browser: Any, width: int) -> None:
    """Assert that the page fits the width of its window and that each text stands out from its ground."""
    (window, wide), beyond = sideways(browser)
    assert (wide <= window == width, beyond) == (True, [])
    contrasts = browser.execute_script(CONTRAST)
    assert contrasts
    assert [each for each in contrasts if each[0] < 4.5 and "disabled" not in each[1]] == []
