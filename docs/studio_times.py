"""Seconds from the end of a stroke to field and surface on the page of `crossfield studio`.

`python docs/studio_times.py` draws a stroke on samples in Chromium, and prints the table of
docs/tutorials/studio.md. The page itself takes the times. It needs Chromium, its driver and Selenium.
"""

from __future__ import annotations

import re
import statistics
from typing import Any, Final

from selenium.webdriver.support.ui import WebDriverWait
from studio_pictures import PATIENCE, page_of

SAMPLES: Final = ("mouse", "bottle", "ring")
SIZES: Final = (48, 128)
REPEATED: Final = 3
PARTS: Final = ("field", "surface")
RESIZE: Final = """const size = document.querySelector("#size"); size.value = arguments[0];
for (const kind of ["input", "change"]) size.dispatchEvent(new Event(kind, { bubbles: true }));"""
BOX: Final = """const r = document.querySelector("#drawing").getBoundingClientRect();
return [r.x, r.y, r.width, r.height];"""
READY: Final = "return document.documentElement.dataset.state === 'ready'"


def wait_until_ready(page: Any) -> None:
    """Wait until all answers to the last edit have arrived."""
    page.execute_async_script("setTimeout(arguments[0], 300)")
    WebDriverWait(page, PATIENCE).until(lambda shown: shown.execute_script(READY))


def draw_stroke(page: Any, number: int) -> dict[str, float]:
    """Draw a short stroke in the middle of the drawing; the seconds that the page states."""
    box = page.execute_script(BOX)
    x, y = box[0] + box[2] / 2, box[1] + box[3] / 2 + 12 * number
    for kind, dx, buttons in (("mousePressed", -8, 1), ("mouseMoved", 0, 1), ("mouseReleased", 8, 0)):
        event = {"type": kind, "x": x + dx, "y": y, "button": "left", "buttons": buttons, "clickCount": 1}
        page.execute_cdp_cmd("Input.dispatchMouseEvent", event)
    wait_until_ready(page)
    text = page.execute_script("return document.querySelector('#times').textContent")
    seconds = {name: float(value) for name, value in re.findall(r"(\w+) ([\d.]+) s", text)}
    return {"field": seconds.get("fine", seconds["field"]), "surface": seconds["surface"]}


def main() -> None:
    """Print a row for each sample and size: the middle one of several strokes."""
    print(f"| sample | size | {' | '.join(f'{part}, s' for part in PARTS)} |")
    print("| --- | ---: | ---: | ---: |")
    for sample in SAMPLES:
        with page_of(sample) as page:
            for size in SIZES:
                page.execute_script(RESIZE, size)
                wait_until_ready(page)
                strokes = [draw_stroke(page, number) for number in range(REPEATED)]
                cells = [f"{statistics.median(times[part] for times in strokes):.2f}" for part in PARTS]
                print(f"| `{sample}` | {size} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
