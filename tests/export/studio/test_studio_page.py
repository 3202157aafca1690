"""The page of the studio in a real browser, from the first stroke to a saved session."""

from __future__ import annotations

import json
import math

import crossfield as cf
import pytest
from browsing import CONTRAST, find, show, sideways
from crossfield.models.sketch.samples import sample_svg
from studio_pages import BOX, banner, document, drag, load, opened, pebble, settled, tool, until
from studios import CONTRADICTING, PEBBLE, studio

pytestmark = pytest.mark.slow


def circle(x, y, radius, count=40):
    return [
        (x + radius * math.cos(math.tau * k / count), y + radius * math.sin(math.tau * k / count))
        for k in range(count + 1)
    ]


def given(browser, folder, pressed):
    """Name and content of the file that arrives when a button is pressed."""
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
    drag(browser, circle(240, 300, 150))
    drag(browser, [(95, 300), (170, 340), (240, 350), (310, 340), (385, 300)])
    drag(browser, [(240, 155), (225, 230), (225, 370), (240, 445)])
    assert [stroke["mark"] for stroke in document(browser)["strokes"]] == ["cut", "line", "line"]
    whole = pixels(browser)
    assert "surface" in find(browser, "#times").text

    tool(browser, "unpaint")
    drag(browser, [(160, 220), (180, 220)])
    assert pixels(browser) < whole
    find(browser, "#undo").click()
    assert pixels(settled(browser)) == whole

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


def test_hints_lead_to_a_determined_field(empty):
    def hint():
        return find(empty, "#next").text

    def pressed():
        return find(empty, "#marks [aria-pressed=true]").get_attribute("data-mark")

    assert ("outline" in hint(), pressed()) == (True, "cut")
    drag(empty, circle(240, 300, 150)[:21])
    assert ("outline" in hint(), pressed()) == (True, "cut")
    drag(empty, circle(240, 300, 150)[20:])
    assert ("along which the surface bends" in hint(), pressed()) == (True, "line")
    drag(empty, [(95, 300), (170, 320), (240, 350), (310, 330), (385, 300)])
    drag(empty, [(110, 370), (170, 385), (240, 400), (310, 385), (370, 370)])
    assert "across the others" in hint()
    assert "arbitrary" in find(empty, "#surface-note").text
    assert find(empty, "#doubts").text == "The field is not determined yet."
    find(empty, "[data-mark=cut]").click()
    assert "Choose Curvature line. Draw a line" in hint()
    find(empty, "[data-mark=line]").click()
    drag(empty, [(240, 155), (225, 230), (225, 370), (240, 445)])
    assert hint() == ""
    assert "arbitrary" not in find(empty, "#surface-note").text
    assert [stroke["mark"] for stroke in document(empty)["strokes"]] == ["cut", "cut", *["line"] * 3]
    for _ in range(5):
        find(empty, "#undo").click()
    settled(empty)
    assert ("outline" in hint(), pressed()) == (True, "cut")


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
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (300, 200), (250, 220, 120))
    pen = ImageDraw.Draw(image)
    pen.ellipse([60, 20, 240, 180], outline="black", width=4)
    pen.line([62, 100, 238, 100], fill=(220, 0, 0), width=4)
    image.save(tmp_path / "photo.png")
    browser = load(empty, tmp_path / "photo.png", (tmp_path / "photo.png").read_bytes())
    slide(browser, "#opacity", 1)
    red, green, blue, solid = shown_at(browser, 20, 20)
    assert (red > 200, green > 180, blue < 170, solid) == (True, True, True, 255)
    slide(browser, "#opacity", 0)
    assert shown_at(browser, 20, 20)[3] == 0
    slide(browser, "#opacity", 1)
    folder = tmp_path / "saved"
    folder.mkdir()
    saved = given(browser, folder, find(browser, "[data-do=save]").click)
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


def test_page_and_command_line_read_the_same_instance_until_a_stroke_is_changed(empty, tmp_path):
    data = sample_svg("bottle").encode()
    browser = load(empty, tmp_path / "bottle.svg", data)
    (tmp_path / "bottle.svg").write_bytes(data)
    read = cf.read_sketch(tmp_path / "bottle.svg", size=48).sha256

    def downloaded(folder):
        folder.mkdir()
        find(browser, "#download-menu summary").click()
        return cf.read_instance(
            given(browser, folder, find(browser, "[data-download=instance]").click)
        ).sha256

    assert downloaded(tmp_path / "opened") == read
    tool(browser, "erase")
    drag(browser, [(240, 300), (245, 330)])
    tool(browser, "draw")
    drag(browser, [(300, 300), (360, 340)])
    assert downloaded(tmp_path / "changed") != read
    find(browser, "#undo").click()
    find(browser, "#undo").click()
    settled(browser)
    assert downloaded(tmp_path / "undone") == read


def test_every_edit_is_undone_and_done_again(empty, tmp_path):
    browser = pebble(empty, tmp_path)
    states = [document(browser)]
    tool(browser, "erase")
    drag(browser, [(240, 300), (245, 330)])
    find(browser, "#silhouette").click()
    settled(browser)
    tool(browser, "area")
    drag(browser, [(120, 260), (120, 260)])
    states.append(document(browser))
    assert len(states[1]["mask"]) == 1
    assert states[1]["silhouette"] == "outer"
    while find(browser, "#undo").is_enabled():
        find(browser, "#undo").click()
    assert document(settled(browser)) == states[0]
    while find(browser, "#redo").is_enabled():
        find(browser, "#redo").click()
    assert document(settled(browser)) == states[1]


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
    drawn = document(browser)
    browser.refresh()
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


def test_a_session_of_another_version_is_refused_with_a_remedy(empty, tmp_path):
    browser = pebble(empty, tmp_path)
    path = tmp_path / "newer.json"
    path.write_text(json.dumps(PEBBLE | {"version": 2}))
    find(browser, "#file").send_keys(str(path))
    until(browser, lambda _: "version 2" in banner(browser))
    assert "download the drawing there" in banner(browser)
    assert document(browser) == PEBBLE
    browser.execute_script("sessionStorage.setItem('crossfield-studio', arguments[0])", path.read_text())
    browser.refresh()
    assert "version is 2" in banner(settled(browser))
    assert "version 1" in banner(browser)


def test_it_works_with_the_keyboard_alone(empty):
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.keys import Keys

    browser = empty
    keys = ActionChains(browser)
    browser.execute_script("document.querySelector('#name').focus()")
    for _ in range(40):
        keys.send_keys(Keys.TAB).perform()
        if browser.execute_script("return document.activeElement.id") == "drawing":
            break
    assert browser.execute_script("return document.activeElement.id") == "drawing"
    keys.send_keys("1", Keys.ARROW_LEFT * 10, Keys.SPACE, Keys.ARROW_RIGHT * 20, Keys.SPACE).perform()
    keys.send_keys(
        "2", Keys.ARROW_LEFT * 10, Keys.ARROW_UP * 10, Keys.SPACE, Keys.ARROW_DOWN * 20, Keys.SPACE
    )
    keys.perform()
    settled(browser)
    assert [stroke["mark"] for stroke in document(browser)["strokes"]] == ["line", "cut"]
    keys.key_down(Keys.CONTROL).send_keys("a").key_up(Keys.CONTROL).send_keys("1").perform()
    assert {stroke["mark"] for stroke in document(settled(browser))["strokes"]} == {"line"}
    keys.key_down(Keys.CONTROL).send_keys("z").key_up(Keys.CONTROL).perform()
    assert {stroke["mark"] for stroke in document(settled(browser))["strokes"]} == {"line", "cut"}
    keys.send_keys("b").perform()
    assert find(browser, "[data-tool=paint]").get_attribute("aria-pressed") == "true"
    keys.send_keys("q").perform()
    assert find(browser, "input[value=lines]").is_selected()
    keys.send_keys("?").perform()
    assert find(browser, "#dialog").is_displayed()


def test_every_control_has_a_name(empty):
    nameless = empty.execute_script(
        "return [...document.querySelectorAll('button, input:not([hidden]), select, summary, canvas')]"
        ".filter(each => !each.textContent.trim() && !each.ariaLabel && !each.labels?.length)"
        ".map(each => each.outerHTML)"
    )
    assert nameless == []


@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_and_can_be_read(empty, tmp_path, width, scheme):
    browser = empty
    show(browser, width=width, scheme=scheme)
    pebble(browser, tmp_path)
    find(browser, "#download-menu summary").click()
    (window, wide), beyond = sideways(browser)
    assert wide <= window == width
    assert beyond == []
    worst = browser.execute_script(CONTRAST)
    assert [contrast for contrast in worst if contrast[0] < 4.5 and "disabled" not in contrast[1]] == []
    assert browser.get_log("browser") == []


def test_a_finger_draws_on_a_phone(empty):
    show(empty, width=390)
    x, y = empty.execute_script(BOX, "#drawing")

    def touch(kind, *points):
        places = [{"x": x + a, "y": y + b} for a, b in points]
        empty.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})

    touch("touchStart", (60, 100))
    for step in range(1, 9):
        touch("touchMove", (60 + 20 * step, 100 + 10 * step))
    touch("touchEnd")
    assert len(document(settled(empty))["strokes"]) == 1


@pytest.mark.parametrize(
    "name, content",
    [
        ("photo.png", b"\x89PNG\r\n\x1a\nnothing"),
        ("empty.svg", b""),
        ("notes.txt", b"some words"),
        ("old.json", b'{"format": "crossfield-studio", "version": 1, "strokes": [{"points": ["x"]}]}'),
    ],
)
def test_a_wrong_file_gets_a_message_and_nothing_is_lost(empty, tmp_path, name, content):
    browser = pebble(empty, tmp_path)
    path = tmp_path / name
    path.write_bytes(content)
    find(browser, "#file").send_keys(str(path))
    place = browser.execute_script(BOX, "#drawing")
    until(browser, lambda _: name in banner(browser))
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
        folder = tmp_path / "saved"
        folder.mkdir()
        saved = given(browser, folder, find(browser, "[data-do=save]").click)
        with studio("--port", page.host.split(":")[1]) as another:
            find(browser, "#retry").click()
            until(browser, lambda _: "was started again" in banner(browser))
            assert "go to the new address" in banner(browser)
            assert "save" in banner(browser).lower()
            opened(browser, another.address)
            assert document(browser) == kept
        assert json.loads(saved.read_text()) == kept


def in_space(browser, folder):
    """The browser with a drawing in space and the tool that turns it, and the document."""
    ring = [(math.cos(t / 5), math.sin(t / 5), 0.3 * math.sin(t / 2)) for t in range(32)]
    lines = [f"v {len(ring)}", *(" ".join(f"{x:.4f}" for x in point) for point in ring)]
    lines += ["v 2", "-1 0 0", "1 0 0.5", "v 2", "0 -1 0", "0 1 -0.5"]
    load(browser, folder / "a.curves", "\n".join(lines).encode())
    tool(browser, "turn")
    return browser, document(browser)


def test_a_drawing_in_space_is_turned_by_dragging_also_after_a_reload(empty, tmp_path):
    browser, before = in_space(empty, tmp_path)
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
    browser = pebble(empty, tmp_path, strokes=CONTRADICTING, size=32)
    assert "2 strokes do not fit" in find(browser, "#doubts").text
    find(browser, "#doubts button:nth-of-type(2)").click()
    marks = [stroke["mark"] for stroke in document(settled(browser))["strokes"]]
    assert marks == ["cut", *["line"] * 7, "cut", "cut"]
    assert "do not fit" not in find(browser, "#doubts").text
    find(browser, "[data-do=save]").click()
    upright = [{"points": [x, 14, x, 86], "mark": "line", "weight": 1} for x in range(16, 110, 8)]
    browser = pebble(browser, tmp_path, strokes=[*CONTRADICTING[:9], *upright], size=32)
    assert "1 stroke does not fit. Probably it is not a curvature line" in find(browser, "#doubts").text


def test_hatching_comes_ignored_with_a_note(empty, tmp_path):
    hatching = "".join(f'<path d="M{20 + 2 * k} 30l9 20"/>' for k in range(12))
    body = f'<svg fill="none" stroke="black"><circle cx="50" cy="50" r="45"/>{hatching}'
    browser = load(empty, tmp_path / "body.svg", f'{body}<path d="M10 50H90" stroke="red"/></svg>'.encode())
    assert "12 parallel lines round (35.5, 40) look like hatching" in banner(browser)
    marks = [stroke["mark"] for stroke in document(browser)["strokes"]]
    assert marks == ["cut", *12 * ["ignored"], "line"]
