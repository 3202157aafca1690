"""The page of `crossfield studio` in a browser: opened, waited for, drawn on."""

from __future__ import annotations

import json

from browsing import find
from studios import PEBBLE

READY = "return document.documentElement.dataset.state === 'ready'"
BOX = "const r = document.querySelector(arguments[0]).getBoundingClientRect(); return [r.x, r.y]"


def opened(browser, address):
    browser.get(address)
    return settled(browser)


def until(browser, holds):
    """What a function of the browser returns as soon as it is true."""
    from selenium.webdriver.support.ui import WebDriverWait

    return WebDriverWait(browser, 200, 0.05).until(holds)


def settled(browser):
    """The browser once all answers to the last edit have arrived."""
    until(browser, lambda page: page.execute_script(READY))
    return browser


def document(browser):
    return json.loads(browser.execute_script("return sessionStorage.getItem('crossfield-studio')"))


def drag(browser, points, canvas="#drawing", *, shift=False):
    """Press the mouse at the first of these points of a canvas, move along the others, and let go."""
    x, y = browser.execute_script(BOX, canvas)

    def send(kind, point, buttons):
        place = {"x": x + point[0], "y": y + point[1]}
        browser.execute_cdp_cmd(
            "Input.dispatchMouseEvent",
            {
                "type": kind,
                **place,
                "button": "left",
                "buttons": buttons,
                "clickCount": 1,
                "modifiers": 8 * shift,
            },
        )

    send("mousePressed", points[0], 1)
    for point in points[1:]:
        send("mouseMoved", point, 1)
    send("mouseReleased", points[-1], 0)
    return settled(browser)


def press(browser, *keys, control=False):
    """Press keys: letters, or names such as ARROW_LEFT."""
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    actions = ActionChains(browser)
    if control:
        actions.key_down(Keys.CONTROL)
    actions.send_keys(*(getattr(Keys, key, key) for key in keys)).key_up(Keys.CONTROL).perform()


def tool(browser, name):
    find(browser, f"[data-tool={name}]").click()


def write(path, content):
    path.write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())
    return path


def banner(browser):
    return find(browser, "#banner span").text


def load(browser, path, content):
    write(path, content)
    browser.execute_script("document.documentElement.dataset.state = 'loading'")
    find(browser, "#file").send_keys(str(path))
    return settled(browser)


def pebble(browser, folder, **parts):
    return load(browser, folder / "pebble.studio.json", PEBBLE | parts)
