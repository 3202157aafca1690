"""Pictures of the page of `crossfield studio`, for docs/tutorials/studio.md.

`python docs/studio_pictures.py` draws docs/pictures/studio_page.png and studio_doubts.png anew. It needs
Chromium, its driver and Selenium.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

from PIL import Image
from selenium import webdriver
from selenium.webdriver.support.ui import WebDriverWait

PICTURES: Final = Path(__file__).resolve().parent / "pictures"
SIZE: Final = (1280, 840)
PATIENCE: Final = 120


def browser() -> Any:
    """A headless Chromium of that size."""
    options = webdriver.ChromeOptions()
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", f"--window-size={SIZE[0]},{SIZE[1]}"):
        options.add_argument(argument)
    return webdriver.Chrome(
        options=options, service=webdriver.ChromeService(shutil.which("chromedriver") or "")
    )


def shot(page: Any, name: str, *selectors: str) -> None:
    """Click these controls, wait for the surface, and write a picture."""
    for selector in selectors:
        page.find_element("css selector", selector).click()
    ready = "return document.documentElement.dataset.state === 'ready'"
    WebDriverWait(page, PATIENCE).until(lambda each: each.execute_script(ready))
    page.execute_script("document.querySelector('#times').textContent = ''")  # it differs from run to run
    page.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0], 300))")
    with Image.open(io.BytesIO(page.get_screenshot_as_png())) as image:
        image.convert("RGB").save(PICTURES / name, optimize=True)


def main() -> None:
    """Draw both pictures."""
    command = [sys.executable, "-m", "crossfield", "studio", "bottle", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        page = browser()
        try:
            page.execute_cdp_cmd(
                "Emulation.setDeviceMetricsOverride",
                {"width": SIZE[0], "height": SIZE[1], "deviceScaleFactor": 1, "mobile": False},
            )
            page.get(server.stdout.readline().strip())
            shot(page, "studio_page.png", "input[value=lines]", "input[value=matcap]")
            shot(
                page,
                "studio_doubts.png",
                "#open-menu summary",
                "[data-sample=cylinder_bend]",
                "input[value=angle]",
                "input[value=normals]",
            )
        finally:
            page.quit()
            server.terminate()


if __name__ == "__main__":
    main()
