"""The page of the studio in a real browser, from the first stroke to a saved session."""

from __future__ import annotations

import base64
import io
import json
import math
import os
import signal

import numpy as np
import pytest
from browsing import check_legibility, find, show
from children import running
from command_line import invoke
from crossfield.export.studio.document import Document
from crossfield.export.studio.session import hints_on_mask, read_drawn
from PIL import Image, ImageDraw
from small_drawings import png, sample_svg
from studio_pages import BOX, banner, document, drag, load, opened, pebble, press, settled, tool, until, write
from studios import CROSSED, PEBBLE, studio

pytestmark = pytest.mark.slow


def circle(x, y, radius, count=40):
    return [
        (x + radius * math.cos(math.tau * k / count), y + radius * math.sin(math.tau * k / count))
        for k in range(count + 1)
    ]


def given(browser, folder, pressed):
    """The file that arrives in a folder when a button is pressed."""
    folder.mkdir(exist_ok=True)
    browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(folder)})
    pressed()
    kept = until(
        browser, lambda _: [path for path in folder.iterdir() if path.suffix not in {".crdownload", ".tmp"}]
    )
    return kept[0]


def pixels(browser):
    return int(find(browser, "#numbers").text.split("Pixels\n")[1].split("\n")[0])


def test_a_session_from_the_first_stroke_to_the_saved_file(empty, tmp_path):
    browser = empty

    def hint():
        pressed = find(browser, "#marks [aria-pressed=true]").get_attribute("data-mark")
        return find(browser, "#next").text, pressed

    assert hint() == ("Draw the outline of a shape, and close it.", "cut")
    drag(browser, circle(240, 300, 150)[:21])
    assert hint() == ("Draw the outline of a shape, and close it.", "cut")
    find(browser, "#undo").click()
    drag(settled(browser), circle(240, 300, 150))
    bends = ("Draw a line along which the surface bends.", "line")
    assert hint() == bends
    for button, expected in (("#undo", "cut"), ("#redo", "line")):
        find(browser, button).click()
        settled(browser)
        assert hint()[1] == expected
    assert hint() == bends
    drag(browser, [(95, 300), (170, 340), (240, 350), (310, 340), (385, 300)])
    assert hint() == ("Draw a line across the others.", "line")
    assert "arbitrary" in find(browser, "#surface-note").text
    assert find(browser, "#doubts").text == "The field is not determined yet."
    find(browser, "[data-mark=cut]").click()
    assert hint() == ("Choose Curvature line. Draw a line across the others.", "cut")
    find(browser, "[data-mark=line]").click()
    drag(browser, [(240, 155), (225, 230), (225, 370), (240, 445)])
    assert hint() == ("", "line")
    assert "arbitrary" not in find(browser, "#surface-note").text
    assert [stroke["mark"] for stroke in document(browser)["strokes"]] == ["cut", "line", "line"]
    whole = pixels(browser)
    assert "surface" in find(browser, "#times").text

    tool(browser, "unpaint")
    drag(browser, [(160, 220), (180, 220)])
    assert pixels(browser) < whole
    find(browser, "#undo").click()
    assert pixels(settled(browser)) == whole

    (bowl,) = (
        each for each in browser.find_elements("css selector", "#doubts button") if "bowl" in each.text
    )
    bowl.click()
    assert len(document(settled(browser))["concave"]) == 1
    assert "bowl" not in find(browser, "#doubts").text
    find(browser, "#unhint").click()
    assert document(settled(browser))["concave"] == []

    drag(browser, [(240, 300), (240, 240)], "#surface")
    (hint,) = document(browser)["hints"]
    assert hint["tilt"] == 90
    find(browser, "#flip").click()
    settled(browser)
    assert (document(browser)["flip"], document(browser)["hints"][0]["tilt"]) == (True, -90)

    tool(browser, "select")
    drag(browser, [(240, 155), (240, 155)])
    find(browser, "[data-mark=ignored]").click()
    settled(browser)
    assert "ignored" in {stroke["mark"] for stroke in document(browser)["strokes"]}
    find(browser, "#undo").click()
    settled(browser)
    before = document(browser)

    find(browser, "#download-menu summary").click()
    field = given(browser, tmp_path, find(browser, "[data-download=field]").click)
    assert field.name == "drawing.field.npz"
    field.unlink()
    saved = given(browser, tmp_path, find(browser, "[data-do=save]").click)
    find(browser, "#open-menu summary").click()
    find(browser, "[data-do=empty]").click()
    assert document(settled(browser))["strokes"] == []
    load(browser, tmp_path / "again.json", saved.read_bytes())
    assert document(browser) == before


def shown_at(browser, x, y):
    """Colour of the drawing canvas at a point of the document."""
    return browser.execute_script(
        """const canvas = document.querySelector("#drawing"), ratio = devicePixelRatio;
        const [, , wide, high] = arguments[0];
        const scale = 0.94 * Math.min(canvas.clientWidth / wide, canvas.clientHeight / high);
        const at = [[canvas.clientWidth, wide, arguments[1]], [canvas.clientHeight, high, arguments[2]]];
        const [x, y] = at.map(([room, side, value]) => ratio * ((room - scale * side) / 2 + scale * value));
        return [...canvas.getContext("2d").getImageData(x, y, 1, 1).data];""",
        document(browser)["page"], x, y,
    )  # fmt: skip


def slide(browser, selector, value):
    browser.execute_script(
        "const slider = document.querySelector(arguments[0]); slider.value = arguments[1];"
        "for (const kind of ['input', 'change']) slider.dispatchEvent(new Event(kind, { bubbles: true }))",
        selector, value,
    )  # fmt: skip
    browser.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0], 100))")


def test_a_picture_lies_under_its_traced_strokes(empty, tmp_path):
    image = Image.new("RGB", (300, 200), (250, 220, 120))
    ImageDraw.Draw(image).ellipse([60, 20, 240, 180], outline="black", width=4)
    ImageDraw.Draw(image).line([62, 100, 238, 100], fill=(220, 0, 0), width=4)
    browser = load(empty, tmp_path / "photo.png", png(image))
    slide(browser, "#opacity", 1)
    red, green, blue, solid = shown_at(browser, 20, 20)
    assert (red > 200, green > 180, blue < 170, solid) == (True, True, True, 255)
    slide(browser, "#opacity", 0)
    assert shown_at(browser, 20, 20)[3] == 0
    slide(browser, "#opacity", 1)
    saved = given(browser, tmp_path / "saved", find(browser, "[data-do=save]").click)
    for again in (browser.refresh, lambda: load(browser, tmp_path / "saved.json", saved.read_bytes())):
        again()
        settled(browser)
        slide(browser, "#opacity", 1)
        assert shown_at(browser, 20, 20) == [red, green, blue, solid]
    find(browser, "#open-menu summary").click()
    find(browser, "[data-do=empty]").click()
    assert not find(settled(browser), "#opacity").is_displayed()
    find(browser, "#undo").click()
    assert find(settled(browser), "#opacity").is_displayed()


SHOWN = """// keeps the picture that is painted last on the surface canvas, and its place
const draw = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function(image, ...box) {
  if (this.canvas.id === "surface" && box.length === 4) window.shown = [image.toDataURL(), box];
  return draw.call(this, image, ...box);
};
"""


@pytest.mark.parametrize("content", [sample_svg("bottle").encode(), PEBBLE])
def test_the_preview_is_the_picture_that_shade_writes(empty, tmp_path, content):
    path = tmp_path / ("drawing.json" if content is PEBBLE else "drawing.svg")
    browser = load(empty, path, content)
    slide(browser, "#size", 24)
    find(browser, "#ink").click()
    browser.execute_script(SHOWN)
    drag(settled(browser), [(200, 300), (230, 270)], "#surface")
    if content is PEBBLE:
        find(browser, "#download-menu summary").click()
        path = given(browser, tmp_path / "saved", find(browser, "[data-download=drawing]").click)
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    picture, (left, top, wide, high) = browser.execute_script("return window.shown")
    shown = np.asarray(Image.open(io.BytesIO(base64.b64decode(picture.split(",")[1])))).astype(int)
    session = Document.from_json(document(browser))
    (hint,) = hints_on_mask(session, read_drawn(session).instance)
    x, y, *sides = session.page
    units = shown.shape[1] / wide, shown.shape[0] / high
    angles = [str(round(math.degrees(angle))) for angle in (hint.slant, hint.tilt)]
    options = ["--size", "24", "--side", str(round(max(np.multiply(sides, units))))]
    options += ["--hint", ",".join([str(hint.row), str(hint.column), *angles])]
    assert invoke(["shade", str(path), "-o", str(tmp_path / "out"), *options]) == 0
    column, row = round((left - x) * units[0]), round((top - y) * units[1])
    box = (column, row, column + shown.shape[1], row + shown.shape[0])
    off = np.abs(np.asarray(Image.open(tmp_path / "out" / "shaded.png").crop(box)) - shown)
    opaque = shown[..., 3] == 255
    assert opaque.mean() > 0.2
    assert off[..., 3].max() == 0
    assert off[opaque].max() <= 1


DRAWN = """// counts the parts of strokes that are painted
const line = Path2D.prototype.lineTo;
window.drawn = 0;
Path2D.prototype.lineTo = function (...to) { window.drawn += 1; return line.apply(this, to); };
"""


def test_a_stroke_more_paints_none_of_the_others_again(empty, tmp_path):
    lines = [{"points": [10, y / 4, 60, y / 4 + 2, 110, y / 4], "mark": "line"} for y in range(48, 352)]
    browser = pebble(empty, tmp_path, strokes=[*PEBBLE["strokes"], *lines])
    browser.execute_script(DRAWN)
    drag(browser, [(100 + 20 * k, 300) for k in range(8)])
    assert len(document(browser)["strokes"]) == 3 + len(lines) + 1
    assert 0 < browser.execute_script("return window.drawn") < len(lines)


def answer(browser, *, accept):
    """Answer the question that the page asks, and return its text."""
    from selenium.webdriver.support import expected_conditions

    question = until(browser, expected_conditions.alert_is_present())
    text = question.text
    question.accept() if accept else question.dismiss()
    return text


def test_no_drawing_is_lost_by_a_reload_and_another_file(empty, tmp_path):
    browser = empty
    drag(browser, [(100, 200), (200, 220), (300, 200)])
    drag(browser, [(100, 300), (200, 320), (300, 300)])
    drawn = document(browser)
    browser.refresh()
    assert document(settled(browser)) == drawn
    find(browser, "#undo").click()
    assert document(settled(browser))["strokes"] == drawn["strokes"][:1]
    browser.refresh()
    find(settled(browser), "#redo").click()
    assert document(settled(browser)) == drawn
    other = tmp_path / "other.studio.json"
    other.write_text(json.dumps(PEBBLE))
    for accept, shown in ((False, drawn), (True, PEBBLE)):
        find(browser, "#file").send_keys(str(other))
        assert "not in a saved file" in answer(browser, accept=accept)
        until(browser, lambda _, shown=shown: document(browser) == shown)
    find(browser, "#undo").click()
    assert document(settled(browser)) == drawn
    find(browser, "#redo").click()
    assert document(settled(browser)) == PEBBLE


def test_the_drawing_of_the_command_line_replaces_one_of_an_earlier_page_only_on_request(browser):
    with studio("skew") as page:
        opened(browser, page.address)
        browser.execute_script(
            "sessionStorage.setItem('crossfield-studio', arguments[0]);"
            "sessionStorage.setItem('crossfield-studio-at', 'elsewhere')",
            json.dumps(PEBBLE),
        )
        browser.refresh()
        assert "Keep it" in answer(browser, accept=False)
        assert document(settled(browser))["name"] == "skew"
        find(browser, "#undo").click()
        assert document(settled(browser)) == PEBBLE


def test_a_session_of_another_version_is_refused_after_a_reload(empty):
    newer = json.dumps(PEBBLE | {"version": 2})
    empty.execute_script("sessionStorage.setItem('crossfield-studio', arguments[0])", newer)
    empty.refresh()
    assert "version is 2" in banner(settled(empty))
    assert "version 1" in banner(empty)


def test_it_works_with_the_keyboard_alone(empty):
    browser = empty

    def marks():
        return [stroke["mark"] for stroke in document(settled(browser))["strokes"]]

    def focus():
        return browser.execute_script("return document.activeElement.id")

    browser.execute_script("document.querySelector('#name').focus()")
    for _ in range(40):
        press(browser, "TAB")
        if focus() == "drawing":
            break
    assert focus() == "drawing"
    left, right = ["ARROW_LEFT"] * 10, ["ARROW_RIGHT"] * 20
    press(browser, "1", *left, "SPACE", *right, "SPACE")
    press(browser, "2", *left, *["ARROW_UP"] * 10, "SPACE", *["ARROW_DOWN"] * 20, "SPACE")
    assert marks() == ["line", "cut"]
    (_, before) = [stroke["points"] for stroke in document(browser)["strokes"]]
    press(browser, "v", "ENTER", "SPACE", *["ARROW_DOWN"] * 3, "SPACE")
    after = document(settled(browser))["strokes"][1]["points"]
    assert after[::2] == before[::2]
    assert after[1] > before[1]
    press(browser, "a", control=True)
    press(browser, "1")
    assert marks() == ["line", "line"]
    press(browser, "z", control=True)
    assert marks() == ["line", "cut"]
    press(browser, "b")
    assert find(browser, "[data-tool=paint]").get_attribute("aria-pressed") == "true"
    press(browser, "q")
    assert find(browser, "input[value=lines]").is_selected()
    press(browser, "?")
    assert find(browser, "#dialog").is_displayed()


def test_every_control_has_a_name(empty):
    nameless = empty.execute_script(
        "return [...document.querySelectorAll('button, input:not([hidden]), select, summary, canvas')]"
        ".filter(each => !each.textContent.trim() && !each.ariaLabel && !each.labels?.length)"
        ".map(each => each.outerHTML)"
    )
    assert nameless == []
    mute = "return [...document.querySelectorAll('main button, header button:not(.menu *)')].filter("
    mute += "each => !each.title && !each.querySelector('kbd')).map(each => each.outerHTML)"
    assert empty.execute_script(mute) == []


def test_shift_draws_straight_and_an_axis_mirrors_strokes(empty):
    press(empty, "m")
    drag(empty, [(240, 300), (240, 300)])
    drag(empty, [(100, 200), (150, 260), (238, 210)], shift=True)
    middle = document(empty)["axis"][0]
    (left, top, end, low), (right, *others) = [each["points"] for each in document(empty)["strokes"]]
    assert left < middle < right
    assert (right + left, end, others) == (pytest.approx(2 * middle), middle, [top, end, low])
    tool(empty, "erase")
    drag(empty, [(170, 180), (170, 230)])
    assert len(document(empty)["strokes"]) == 4
    press(empty, "m")
    drag(empty, [(240, 400), (240, 400)])
    assert "axis" not in document(empty)


def test_the_view_is_moved_by_the_space_bar_and_zoomed_by_buttons_and_keys(empty):
    def place(change=lambda: None):
        """Left, top and right of a line at the same place of the screen."""
        change()
        tool(empty, "draw")
        return document(drag(empty, [(100, 200), (200, 200)]))["strokes"][-1]["points"][:3]

    def pan():
        space = {"key": " ", "code": "Space"}
        empty.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": "keyDown", **space})
        drag(empty, [(100, 200), (150, 230)])
        empty.execute_cdp_cmd("Input.dispatchKeyEvent", {"type": "keyUp", **space})

    left, top, right = place()
    wide = right - left
    assert place(pan) == pytest.approx([left - wide / 2, top - 0.3 * wide, right - wide / 2], abs=0.01)
    zoomed = place(find(empty, "#left [aria-label='Zoom in']").click)
    assert zoomed[2] - zoomed[0] == pytest.approx(wide / 1.25, abs=0.01)
    assert place(find(empty, "#left [data-zoom='0']").click) == [left, top, right]
    zoomed = place(lambda: press(empty, "-", control=True))
    assert zoomed[2] - zoomed[0] == pytest.approx(wide / 0.8, abs=0.01)
    assert len(document(empty)["strokes"]) == 5


def test_coordinates_of_a_message_mark_their_place(empty, tmp_path):
    hatch = "".join(f'<path d="M{20 + 2 * k} 30l9 20"/>' for k in range(12))
    flow = '<path stroke="red" d="M10 50Q50 30 90 50"/><circle cx="50" cy="50" r="45"/>'
    load(empty, tmp_path / "a.svg", f'<svg fill="none" stroke="black">{hatch}{flow}</svg>'.encode())
    pictures = "return [...document.querySelectorAll('canvas')].map(each => each.toDataURL())"
    wait = "requestAnimationFrame(() => requestAnimationFrame(arguments[0]))"
    seen = []
    for selector in ("#name", "#banner .place", "#name"):
        find(empty, selector).click()
        empty.execute_async_script(wait)
        seen.append(empty.execute_script(pictures))
    assert "round (35.5, 40)" in banner(empty)
    assert seen[0] == seen[2]
    assert all(a != b for a, b in zip(*seen[:2], strict=True))


@pytest.mark.parametrize("width, scheme", [(1280, "light"), (390, "dark")])
def test_it_fits_and_can_be_read(empty, tmp_path, width, scheme):
    show(empty, width=width, scheme=scheme)
    pebble(empty, tmp_path)
    find(empty, "#download-menu summary").click()
    check_legibility(empty, width)
    assert empty.get_log("browser") == []


def test_a_wrong_file_gets_a_message_and_nothing_is_lost(empty, tmp_path):
    browser = pebble(empty, tmp_path)
    place = browser.execute_script(BOX, "#drawing")
    for name, content in (
        ("photo.png", b"\x89PNG\r\n\x1a\nnothing"),
        ("old.json", b'{"format": "crossfield-studio", "version": 1, "strokes": [{"points": ["x"]}]}'),
    ):
        find(browser, "#file").send_keys(str(write(tmp_path / name, content)))
        until(browser, lambda _, name=name: name in banner(browser))
        assert browser.execute_script(BOX, "#drawing") == place  # a stroke under the pen does not jump
        assert document(browser) == PEBBLE


def test_a_lost_server_gets_a_message_and_nothing_is_lost(browser, tmp_path):
    with studio() as page:
        opened(browser, page.address)
        pebble(browser, tmp_path)
        page.stop()
        find(browser, "#silhouette").click()
        until(browser, lambda _: "does not answer" in banner(browser))
        kept = document(browser)
        assert kept == PEBBLE | {"silhouette": "outer"}
        saved = given(browser, tmp_path / "saved", find(browser, "[data-do=save]").click)
        with studio("--port", page.host.split(":")[1]) as another:
            # The page also tries again by itself, and then hides the button.
            browser.execute_script("arguments[0].click()", find(browser, "#retry"))
            until(browser, lambda _: "was started again" in banner(browser))
            assert "go to the new address" in banner(browser)
            assert "save" in banner(browser).lower()
            opened(browser, another.address)
            assert document(browser) == kept
        assert json.loads(saved.read_text()) == kept


def test_a_server_that_hangs_is_reported_and_the_page_recovers(browser, tmp_path):
    with studio() as page:
        opened(browser, page.address)
        pebble(browser, tmp_path)
        page.process.send_signal(signal.SIGSTOP)
        find(browser, "#silhouette").click()
        until(browser, lambda _: "does not answer" in banner(browser))
        assert find(settled(browser), "#status").text == "No server."
        assert document(browser)["silhouette"] == "outer"
        page.process.send_signal(signal.SIGCONT)
        until(browser, lambda _: not find(browser, "#banner").is_displayed())
        assert find(settled(browser), "#status").text == ""


def test_a_process_that_is_killed_is_reported_with_a_remedy(browser, tmp_path):
    with studio() as page:
        opened(browser, page.address)
        pebble(browser, tmp_path)
        children = [number for number, (parent, _) in running().items() if parent == page.process.pid]
        find(browser, "#file").send_keys(str(write(tmp_path / "a.json", PEBBLE | {"size": 256})))
        until(browser, lambda _: "48 ×" in find(browser, "#numbers").text)
        for child in children:
            os.kill(child, signal.SIGKILL)
        until(browser, lambda _: "choose a smaller size." in banner(browser))
        pebble(browser, tmp_path)
        assert not find(browser, "#banner").is_displayed()


def test_a_drawing_in_space_is_turned_by_dragging_also_after_a_reload(empty, tmp_path):
    ring = [(math.cos(t / 5), math.sin(t / 5), 0.3 * math.sin(t / 2)) for t in range(32)]
    lines = [f"v {len(ring)}", *(" ".join(f"{x:.4f}" for x in point) for point in ring)]
    lines += ["v 2", "-1 0 0", "1 0 0.5", "v 2", "0 -1 0", "0 1 -0.5"]
    browser = load(empty, tmp_path / "a.curves", "\n".join(lines).encode())
    tool(browser, "turn")
    before = document(browser)
    drag(browser, [(200, 300), (230, 310), (280, 330), (300, 340)])
    until(browser, lambda _: document(browser)["strokes"] != before["strokes"])
    turned = document(settled(browser))
    browser.refresh()
    tool(settled(browser), "turn")
    drag(browser, [(200, 300), (210, 300), (220, 300)])
    until(browser, lambda _: document(browser)["strokes"] != turned["strokes"])
    assert turned["view"][1] >= 33  # from 25
    assert document(browser)["view"][1] == pytest.approx(turned["view"][1], abs=4)
    find(browser, "#undo").click()
    assert document(settled(browser)) == turned


def test_a_doubt_is_followed_by_its_suggestion(empty, tmp_path):
    browser = pebble(empty, tmp_path, strokes=CROSSED, size=24)
    assert "1 stroke crosses" in find(browser, "#doubts").text
    find(browser, "#doubts button:nth-of-type(2)").click()
    marks = [stroke["mark"] for stroke in document(settled(browser))["strokes"]]
    assert marks == ["cut", *["line"] * 6, "cut"]
    assert "stroke crosses" not in find(browser, "#doubts").text
