"""Pen, palm and fingers on the page of the studio, and what they do to strokes."""

from __future__ import annotations

import pytest
from browsing import find, show
from studio_pages import BOX, document, drag, pebble, settled, tool
from studios import PEBBLE

pytestmark = pytest.mark.slow

POINTER = """
const [selector, kind, x, y, options] = arguments, target = document.querySelector(selector);
const place = target.getBoundingClientRect();
target.dispatchEvent(new PointerEvent(kind, { pointerId: 9, pointerType: "pen", bubbles: true,
  cancelable: true, clientX: place.x + x, clientY: place.y + y, ...options }));
"""
PALM = 850  # milliseconds after which a touch is no longer taken for the palm


@pytest.fixture
def tablet(empty):
    """The empty page on a screen that can be touched."""
    empty.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 5})
    yield empty
    empty.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})


def touch(browser, kind, *points, canvas="#drawing"):
    """Send a touch event with fingers at these points of a canvas."""
    x, y = browser.execute_script(BOX, canvas)
    fingers = [{"x": x + a, "y": y + b, "id": number} for number, (a, b) in enumerate(points)]
    browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})


def swipe(browser, begin, end, canvas="#drawing", steps=8):
    """Move one finger over a canvas."""
    points = [
        tuple(a + (b - a) * step / steps for a, b in zip(begin, end, strict=True))
        for step in range(steps + 1)
    ]
    # The page may scroll below the finger: the window stays where it is.
    x, y = browser.execute_script(BOX, canvas)
    kinds = ["touchStart", *["touchMove"] * steps]
    for kind, (a, b) in zip(kinds, points, strict=True):
        browser.execute_cdp_cmd(
            "Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x + a, "y": y + b}]}
        )
    touch(browser, "touchEnd")
    return settled(browser)


def pen(browser, kind, point, force=0.5, canvas="#drawing"):
    """Send an event of a pen at a point of a canvas."""
    x, y = browser.execute_script(BOX, canvas)
    browser.execute_cdp_cmd(
        "Input.dispatchMouseEvent",
        {
            "type": kind,
            "x": x + point[0],
            "y": y + point[1],
            "pointerType": "pen",
            "force": force,
            "button": "left",
            "buttons": 0 if kind == "mouseReleased" else 1,
            "clickCount": 1,
        },
    )


def stroke(browser, *points, forces=None):
    """Draw with the pen."""
    forces = forces or [0.5] * len(points)
    pen(browser, "mousePressed", points[0], forces[0])
    for point, force in zip(points[1:], forces[1:], strict=True):
        pen(browser, "mouseMoved", point, force)
    pen(browser, "mouseReleased", points[-1])
    return settled(browser)


def wait(browser, milliseconds=PALM):
    browser.execute_async_script("setTimeout(arguments[1], arguments[0])", milliseconds)


def spots(browser):
    """The points of all strokes."""
    return [each["points"] for each in document(browser)["strokes"]]


def test_a_palm_before_beside_and_after_the_pen_draws_nothing(tablet):
    touch(tablet, "touchStart", (300, 500))
    pen(tablet, "mousePressed", (100, 300))
    touch(tablet, "touchMove", (303, 505))
    touch(tablet, "touchEnd")
    touch(tablet, "touchStart", (310, 520))
    for step in range(1, 6):
        pen(tablet, "mouseMoved", (100 + 30 * step, 300))
        touch(tablet, "touchMove", (310 + 5 * step, 520 + 5 * step))
    touch(tablet, "touchMove", (310, 520), (330, 560))
    pen(tablet, "mouseReleased", (250, 300))
    touch(tablet, "touchMove", (340, 560))
    touch(tablet, "touchEnd")
    swipe(tablet, (300, 500), (340, 560))
    (line,) = document(settled(tablet))["strokes"]
    assert len(line["points"]) > 8
    assert len({round(y) for y in line["points"][1::2]}) == 1
    assert line["weight"] == 0.5


def test_after_the_pen_one_finger_draws_only_on_demand_and_two_zoom(tablet):
    show(tablet, width=768)
    swipe(tablet, (60, 100), (200, 150))
    assert len(spots(tablet)) == 1
    assert find(tablet, "#fingers").get_attribute("aria-pressed") == "true"
    stroke(tablet, (60, 200), (200, 220), (260, 200))
    assert find(tablet, "#fingers").get_attribute("aria-pressed") == "false"
    wait(tablet)
    swipe(tablet, (60, 250), (200, 280))
    assert len(spots(tablet)) == 2

    touch(tablet, "touchStart", (100, 100))
    touch(tablet, "touchStart", (100, 100), (200, 200))
    for step in range(1, 6):
        touch(tablet, "touchMove", (100 - 5 * step, 100 - 5 * step), (200 + 5 * step, 200 + 5 * step))
    touch(tablet, "touchEnd")
    assert len(spots(tablet)) == 2
    wide = [max(points[::2]) - min(points[::2]) for points in spots(stroke(tablet, (60, 200), (260, 200)))]
    assert wide[2] == pytest.approx(wide[1] * 100 / 150, rel=0.05)  # it is drawn closer

    wait(tablet)
    find(tablet, "#fingers").click()
    swipe(tablet, (60, 250), (200, 280))
    assert len(spots(tablet)) == 4


def test_a_page_of_a_phone_scrolls_under_a_finger(tablet, tmp_path):
    show(tablet, width=390, height=700)
    pebble(tablet, tmp_path)
    top = "return [scrollY, document.querySelector('#surface').getBoundingClientRect().y]"
    tablet.execute_script("document.querySelector('#surface').scrollIntoView()")
    before, _ = tablet.execute_script(top)
    swipe(tablet, (180, 200), (185, 320), "#surface")
    wait(tablet, 300)
    assert tablet.execute_script(top)[0] < before - 50
    assert document(tablet)["hints"] == []

    tablet.execute_script("scrollTo(0, 0)")
    find(tablet, "#fingers").click()
    swipe(tablet, (180, 300), (185, 150))
    wait(tablet, 300)
    assert tablet.execute_script(top)[0] > 50
    assert document(tablet)["strokes"] == PEBBLE["strokes"]


def test_two_taps_on_the_surface_give_a_hint_and_one_takes_it_away(tablet, tmp_path):
    pebble(tablet, tmp_path)

    def tap(*point):
        touch(tablet, "touchStart", point, canvas="#surface")
        touch(tablet, "touchEnd", canvas="#surface")
        return document(settled(tablet))["hints"]

    assert tap(150, 300) == []
    assert "Tap where" in find(tablet, "#status").text
    (hint,) = tap(150, 250)
    assert hint["tilt"] == 90
    assert tap(150, 300) == []
    assert tap(250, 300) == []
    assert tap(252, 301) == []


def test_the_other_end_of_the_pen_erases(tablet, tmp_path):
    pebble(tablet, tmp_path)
    options = {"button": 5, "buttons": 32, "pressure": 0.4}
    middle = tablet.execute_script(
        "const r = document.querySelector('#drawing').getBoundingClientRect(); return [r.width, r.height]"
    )
    x, y = (side / 2 for side in middle)
    tablet.execute_script(POINTER, "#drawing", "pointerdown", x - 60, y - 20, options)
    tablet.execute_script(POINTER, "#drawing", "pointermove", x - 60, y + 60, options | {"button": -1})
    tablet.execute_script(POINTER, "#drawing", "pointerup", x - 60, y + 60, {"button": 5, "buttons": 0})
    assert len(document(settled(tablet))["strokes"]) == 4
    assert find(tablet, "[data-tool=draw]").get_attribute("aria-pressed") == "true"
    find(tablet, "#undo").click()
    assert spots(settled(tablet)) == [each["points"] for each in PEBBLE["strokes"]]


WIDTH = """
const canvas = document.querySelector('#drawing');
const data = canvas.getContext('2d').getImageData(arguments[0], 0, 1, canvas.height).data;
return data.reduce((sum, red, k) => sum + (k % 4 === 0 && red > data[k + 1] + 80 ? data[k + 3] / 255 : 0), 0);
"""
"""Pixels of red ink in a column of the drawing."""


def test_a_stroke_is_as_wide_as_its_pressure(tablet):
    find(tablet, "[data-mark=line]").click()
    stroke(tablet, *((80 + 8 * k, 300) for k in range(31)), forces=[0.05 + 0.03 * k for k in range(31)])
    (line,) = document(tablet)["strokes"]
    assert len(line["pressures"]) == len(line["points"]) / 2
    assert line["pressures"] == sorted(line["pressures"])
    assert line["weight"] == pytest.approx(0.5, abs=0.05)
    find(tablet, "input[value=none]").click()
    wait(tablet, 100)
    thin, thick = (tablet.execute_script(WIDTH, x) for x in (100, 300))
    assert thick > 2 * thin > 1

    tool(tablet, "erase")
    drag(tablet, [(200, 280), (200, 320)])
    first, second = document(tablet)["strokes"]
    assert len(first["pressures"]) == len(first["points"]) / 2
    assert max(first["pressures"]) < min(second["pressures"])


def test_marking_a_selected_stroke_leaves_the_pen_as_it_is(empty):
    drag(empty, [(100, 300), (200, 310), (300, 300)])
    tool(empty, "select")
    drag(empty, [(200, 310), (200, 310)])
    find(empty, "[data-mark=ignored]").click()
    settled(empty)
    tool(empty, "draw")
    assert find(empty, "[data-mark=cut]").get_attribute("aria-pressed") == "true"
    drag(empty, [(100, 400), (200, 410), (300, 400)])
    assert [each["mark"] for each in document(empty)["strokes"]] == ["ignored", "cut"]


def test_strokes_end_at_the_border_of_the_page(empty):
    _, _, wide, high = document(drag(empty, [(200, 300), (300, 310)]))["page"]
    drag(empty, [(300, 350), (20, 340), (-300, 340), (-300, 380), (20, 380), (300, 390)])
    _, out, back = spots(empty)
    assert (out[-2], back[0]) == (0, 0)
    for points in spots(empty):
        assert all(0 <= x <= wide for x in points[::2])
        assert all(0 <= y <= high for y in points[1::2])


def test_selected_strokes_are_moved_copied_and_pasted_with_undo(empty):
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    drag(empty, [(100, 300), (200, 300), (300, 300)])
    states = [spots(empty)]
    tool(empty, "select")
    drag(empty, [(200, 300), (201, 300)])  # a click, from a hand that is not quite still
    assert find(empty, "#selected").text == "1 selected"
    assert spots(empty) == states[0]

    def check(change, count=1):
        change()
        states.append(spots(settled(empty)))
        assert len(states[-1]) == count
        assert states[-1] != states[-2]

    def press(*keys, control=False):
        actions = ActionChains(empty)
        if control:
            actions.key_down(Keys.CONTROL)
        actions.send_keys(*keys).key_up(Keys.CONTROL).perform()

    check(lambda: drag(empty, [(200, 300), (210, 320), (220, 340)]))
    down = [b - a for a, b in zip(states[0][0], states[1][0], strict=True)]
    assert down[1] == pytest.approx(2 * down[0])
    check(lambda: press(Keys.ARROW_DOWN))
    assert states[-1][0][::2] == states[-2][0][::2]
    check(lambda: press(Keys.ARROW_LEFT * 3))
    press("c", control=True)
    check(lambda: press("v", control=True), 2)
    check(lambda: find(empty, "#paste").click(), 3)
    assert find(empty, "#selected").text == "1 selected"
    check(lambda: press("x", control=True), 2)
    check(lambda: press("v", control=True), 3)
    drag(empty, [(230, 250), (230, 250)])
    for _ in range(9):
        find(empty, "#undo").click()
        if spots(settled(empty)) == states[0]:
            break
    assert spots(empty) == states[0]
    while find(empty, "#redo").is_enabled():
        find(empty, "#redo").click()
    assert spots(settled(empty)) == states[-1]


def test_the_keyboard_alone_moves_a_stroke(empty):
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    empty.execute_script("document.querySelector('#drawing').focus()")
    across = [Keys.ARROW_LEFT * 10, Keys.SPACE, Keys.ARROW_RIGHT * 20, Keys.SPACE, Keys.ARROW_LEFT * 5]
    ActionChains(empty).send_keys(*across).perform()
    (before,) = spots(settled(empty))
    moving = ["v", Keys.ENTER, Keys.SPACE, Keys.ARROW_DOWN * 3, Keys.SPACE]
    ActionChains(empty).send_keys(*moving).perform()
    (after,) = spots(settled(empty))
    assert after[::2] == before[::2]
    assert after[1] > before[1]


def test_a_moved_stroke_stays_on_the_page(empty):
    _, _, wide, _ = document(drag(empty, [(100, 300), (200, 300), (300, 300)]))["page"]
    tool(empty, "select")
    drag(empty, [(200, 300), (200, 300)])
    drag(empty, [(200, 300), (300, 300), (1000, 300)])
    (points,) = spots(empty)
    assert max(points) == pytest.approx(wide, abs=0.001)
