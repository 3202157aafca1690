"""Pictures of the page of `crossfield studio`, for docs/tutorials/studio.md.

`python docs/studio_pictures.py` draws docs/pictures/studio_page.png and studio_pipe.png anew. It needs
Chromium, its driver and Selenium.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from PIL import Image
from selenium import webdriver
from selenium.webdriver.support.ui import WebDriverWait

PICTURES: Final = Path(__file__).resolve().parent / "pictures"
METRICS: Final = {"width": 1280, "height": 840, "deviceScaleFactor": 1, "mobile": False}
PIPE: Final = "#open-menu summary|[data-sample=cylinder_bend]|input[value=angle]|input[value=normals]"
PATIENCE: Final = 120


def write_shot(page: Any, name: str, *selectors: str) -> None:
    """Click these controls, wait for the surface, and write a picture."""
    ready = "return document.documentElement.dataset.state === 'ready'"
    wait = WebDriverWait(page, PATIENCE)
    wait.until(lambda shown: shown.execute_script(ready))
    page.execute_script("document.documentElement.dataset.state = 'loading'")
    for selector in selectors:
        page.find_element("css selector", selector).click()
    wait.until(lambda shown: shown.execute_script(ready))
    page.execute_script("document.querySelector('#times').textContent = ''")  # it differs from run to run
    page.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0], 300))")
    with Image.open(io.BytesIO(page.get_screenshot_as_png())) as image:
        image.convert("RGB").save(PICTURES / name, optimize=True)


@contextmanager
def page_of(sample: str) -> Iterator[Any]:
    """The page of the studio with a sample, in Chromium."""
    command = [sys.executable, "-m", "crossfield", "studio", sample, "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        options = webdriver.ChromeOptions()
        for argument in ("--headless=new", "--no-sandbox", "--disable-gpu"):
            options.add_argument(argument)
        page = webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver") or ""))
        try:
            page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", METRICS)
            page.get(server.stdout.readline().strip())
            yield page
        finally:
            page.quit()
            server.terminate()


def main() -> None:
    """Draw both pictures."""
    with page_of("bottle") as page:
        write_shot(page, "studio_page.png", "input[value=lines]", "input[value=matcap]")
        write_shot(page, "studio_pipe.png", *PIPE.split("|"))


if __name__ == "__main__":
    main()
