"""Pen, palm and fingers on the page of the studio, and what they do to strokes."""

from __future__ import annotations

import time

import pytest
from browsing import find, show
from crossfield.export.pictures.palette import LIGHT
from studio_pages import BOX, banner, document, drag, pebble, press, settled, tool, until
from studios import PEBBLE

pytestmark = pytest.mark.slow

POINTER = """
const [selector, kind, x, y, options] = arguments, target = document.querySelector(selector);
const place = target.getBoundingClientRect();
target.dispatchEvent(new PointerEvent(kind, { pointerId: 9, pointerType: "pen", bubbles: true,
  cancelable: true, clientX: place.x + x, clientY: place.y + y, ...options }));
"""


@pytest.fixture
def tablet(empty):
    """The empty page on a screen that can be touched."""
    empty.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 5})
    yield empty
    empty.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})


class Hand:
    """A hand with a pen, on a browser; its events are 10 ms apart on a clock of their own."""

    def __init__(self, browser):
        self.browser = browser
        self.time = time.time()

    def rest(self):
        """Let so much time pass that a touch is no longer taken for the palm."""
        self.time += 1

    def _send(self, command, **event):
        self.time += 0.01
        self.browser.execute_cdp_cmd(f"Input.{command}", event | {"timestamp": self.time})

    def touch(self, kind, *points, on="#drawing"):
        """Touch an element with fingers at these points of it."""
        x, y = self.browser.execute_script(BOX, on)
        fingers = [{"x": x + a, "y": y + b, "id": number} for number, (a, b) in enumerate(points)]
        self._send("dispatchTouchEvent", type=kind, touchPoints=fingers)

    def tap(self, point, on="#drawing"):
        self.touch("touchStart", point, on=on)
        self.touch("touchEnd")
        return settled(self.browser)

    def swipe(self, begin, end, on="#drawing", steps=8):
        """Move one finger over an element, which may scroll below it."""
        x, y = self.browser.execute_script(BOX, on)
        for step in range(steps + 1):
            a, b = (p + (q - p) * step / steps for p, q in zip(begin, end, strict=True))
            kind = "touchMove" if step else "touchStart"
            self._send("dispatchTouchEvent", type=kind, touchPoints=[{"x": x + a, "y": y + b}])
        self.touch("touchEnd")
        return settled(self.browser)

    def pen(self, kind, point, force=0.5):
        """Let the pen press, move or leave the drawing at a point."""
        x, y = self.browser.execute_script(BOX, "#drawing")
        place = {"x": x + point[0], "y": y + point[1], "force": force, "pointerType": "pen"}
        buttons = {"button": "left", "buttons": 0 if kind == "mouseReleased" else 1, "clickCount": 1}
        self._send("dispatchMouseEvent", type=kind, **place, **buttons)

    def stroke(self, *points, forces=None):
        """Draw with the pen."""
        for number, point in enumerate(points):
            force = forces[number] if forces else 0.5
            self.pen("mouseMoved" if number else "mousePressed", point, force)
        self.pen("mouseReleased", points[-1])
        return settled(self.browser)


def spots(browser):
    """The points of all strokes."""
    return [each["points"] for each in document(browser)["strokes"]]


def test_a_palm_before_beside_and_after_the_pen_draws_nothing(tablet):
    hand = Hand(tablet)
    hand.touch("touchStart", (300, 500))
    hand.pen("mousePressed", (100, 300))
    hand.touch("touchMove", (303, 505))
    hand.touch("touchEnd")
    hand.touch("touchStart", (310, 520))
    for step in range(1, 6):
        hand.pen("mouseMoved", (100 + 30 * step, 300))
        hand.touch("touchMove", (310 + 5 * step, 520 + 5 * step))
    hand.touch("touchMove", (310, 520), (330, 560))
    hand.touch("touchEnd")
    hand.touch("touchStart", (20, 10), on="[data-mark=ignored]")
    hand.touch("touchEnd")
    hand.touch("touchStart", (310, 520))
    hand.pen("mouseReleased", (250, 300))
    hand.touch("touchMove", (340, 560))
    hand.touch("touchEnd")
    hand.swipe((300, 500), (340, 560))
    (line,) = document(settled(tablet))["strokes"]
    assert len(line["points"]) > 8
    assert len({round(y) for y in line["points"][1::2]}) == 1
    assert line["weight"] == 0.5
    assert find(tablet, "[data-mark=ignored]").get_attribute("aria-pressed") == "false"


def test_after_the_pen_one_finger_draws_only_on_demand_and_two_zoom(tablet):
    hand = Hand(tablet)
    show(tablet, width=768)
    hand.swipe((60, 100), (200, 150))
    assert len(spots(tablet)) == 1
    assert find(tablet, "#fingers").get_attribute("aria-pressed") == "true"
    hand.stroke((60, 200), (200, 220), (260, 200))
    assert find(tablet, "#fingers").get_attribute("aria-pressed") == "false"
    hand.rest()
    hand.swipe((60, 250), (200, 280))
    assert len(spots(tablet)) == 2
    assert "Press “Finger draws”" in banner(tablet)

    hand.touch("touchStart", (100, 100))
    hand.touch("touchStart", (100, 100), (200, 200))
    for step in range(1, 6):
        hand.touch("touchMove", (100 - 5 * step, 100 - 5 * step), (200 + 5 * step, 200 + 5 * step))
    hand.touch("touchEnd")
    assert len(spots(tablet)) == 2
    wide = [max(points[::2]) - min(points[::2]) for points in spots(hand.stroke((60, 200), (260, 200)))]
    assert wide[2] == pytest.approx(wide[1] * 100 / 150, rel=0.05)  # it is drawn closer

    find(tablet, "#fingers").click()
    hand.swipe((60, 250), (200, 280))
    assert len(spots(tablet)) == 3  # it may be the palm
    hand.rest()
    hand.swipe((60, 250), (200, 280))
    assert len(spots(tablet)) == 4


def test_a_page_of_a_phone_scrolls_under_a_finger(tablet, tmp_path):
    hand = Hand(tablet)
    show(tablet, width=390, height=700)
    pebble(tablet, tmp_path)
    tablet.execute_script("document.querySelector('#surface').scrollIntoView()")
    before = tablet.execute_script("return scrollY")
    hand.swipe((180, 200), (185, 320), on="#surface")
    until(tablet, lambda _: tablet.execute_script("return scrollY") < before - 50)
    assert document(tablet)["hints"] == []

    tablet.execute_script("scrollTo(0, 0)")
    find(tablet, "#fingers").click()
    hand.swipe((180, 300), (185, 150))
    until(tablet, lambda _: tablet.execute_script("return scrollY") > 50)
    assert document(tablet)["strokes"] == PEBBLE["strokes"]


def test_two_taps_on_the_surface_give_a_hint_and_one_takes_it_away(tablet, tmp_path):
    hand = Hand(tablet)
    pebble(tablet, tmp_path)

    def tap(*point):
        return document(hand.tap(point, on="#surface"))["hints"]

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
const ink = k => Math.max(0, data[k] - data[k + 1]) * data[k + 3] / 255 / arguments[1];
return data.reduce((sum, _, k) => sum + (k % 4 === 0 ? ink(k) : 0), 0);
"""
"""Pixels of ink in a column of the drawing, half covered ones as a half; red above green of full ink."""


def test_a_stroke_is_as_wide_as_its_pressure(tablet):
    hand = Hand(tablet)
    find(tablet, "[data-mark=line]").click()
    hand.stroke(*((80 + 8 * k, 300) for k in range(31)), forces=[0.05 + 0.03 * k for k in range(31)])
    (line,) = document(tablet)["strokes"]
    assert len(line["pressures"]) == len(line["points"]) / 2
    assert line["pressures"] == sorted(line["pressures"])
    assert line["weight"] == pytest.approx(0.5, abs=0.05)
    find(tablet, "input[value=none]").click()
    tablet.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    red, green, _ = bytes.fromhex(LIGHT["stroke"][1:])
    full = red - green
    thin, thick = (tablet.execute_script(WIDTH, x, full) for x in (100, 300))
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


def test_strokes_end_at_the_border_of_the_page_and_stay_on_it_when_moved(empty):
    _, _, wide, high = document(drag(empty, [(200, 300), (300, 310)]))["page"]
    drag(empty, [(300, 350), (20, 340), (-300, 340), (-300, 380), (20, 380), (300, 390)])
    _, out, back = spots(empty)
    assert (out[-2], back[0]) == (0, 0)
    for points in spots(empty):
        assert all(0 <= x <= wide for x in points[::2])
        assert all(0 <= y <= high for y in points[1::2])
    tool(empty, "select")
    drag(empty, [(250, 305), (250, 305)])
    drag(empty, [(250, 305), (300, 305), (1000, 305)])
    assert max(spots(empty)[0]) == pytest.approx(wide, abs=0.001)


def test_selected_strokes_are_moved_copied_and_pasted_with_undo(empty):
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

    check(lambda: drag(empty, [(200, 300), (210, 320), (220, 340)]))
    down = [b - a for a, b in zip(states[0][0], states[1][0], strict=True)]
    assert down[1] == pytest.approx(2 * down[0])
    check(lambda: press(empty, "ARROW_DOWN"))
    assert states[-1][0][::2] == states[-2][0][::2]
    press(empty, "c", control=True)
    check(lambda: press(empty, "v", control=True), 2)
    check(lambda: find(empty, "#paste").click(), 3)
    assert find(empty, "#selected").text == "1 selected"
    check(lambda: press(empty, "x", control=True), 2)
    check(lambda: press(empty, "v", control=True), 3)
    drag(empty, [(230, 250), (230, 250)])
    for _ in range(9):
        find(empty, "#undo").click()
        if spots(settled(empty)) == states[0]:
            break
    assert spots(empty) == states[0]
    while find(empty, "#redo").is_enabled():
        find(empty, "#redo").click()
    assert spots(settled(empty)) == states[-1]
