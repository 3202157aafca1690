"""The server of the page: whom it answers, what it streams, and how it ends."""

from __future__ import annotations

import json
import re
import threading

import pytest
from command_line import invoke
from loops import for_each
from studios import PEBBLE, changed, studio

pytestmark = pytest.mark.smoke


@pytest.fixture(scope="module")
def page():
    with studio("skew") as served:
        yield served


def test_the_page_loads_nothing_from_elsewhere(page):
    status, headers, body = page.ask("")
    assert status == 200
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    text = body.decode()
    assert "http" not in text.replace("http-equiv", "")
    assert "<script>" not in text
    _, _, script = page.ask("studio.js")
    modules = re.findall(r'from "\./(.*)"', script.decode())
    assert "pointer.js" in modules
    for name in ("studio.js", "studio.css", *modules):
        status, headers, body = page.ask(name)
        assert status == 200, name
        assert b"http" not in body.replace(b"http-equiv", b""), name


@for_each(
    "path, data, headers",
    [
        ("/", None, {}),
        ("/wrong-token/", None, {}),
        ("/%C3%A9/", None, {}),
        ("", None, {"Host": "example.org"}),
        ("", None, {"Origin": "http://example.org"}),
        ("", None, {"Sec-Fetch-Site": "cross-site"}),
        ("compute", b"{}", {"Origin": None}),
        ("compute", b"{}", {"Origin": "null"}),
        ("compute", b"{}", {"Origin": "http://127.0.0.1:1"}),
        ("open?name=a.svg", b"<svg/>", {"Host": "localhost.example.org"}),
    ],
)
def test_requests_from_elsewhere_are_refused(page, path, data, headers):
    status, _, body = page.ask(path, data, headers=headers)
    assert status == 403
    assert page.address.split("/")[3].encode() not in body


def test_no_other_file_is_served(page):
    for path in ("index.html.j2", "../__init__.py", "%2e%2e/__init__.py", "/etc/passwd"):
        assert page.ask(path)[0] in {403, 404}, path


def test_the_drawing_of_the_command_line_is_the_first_and_samples_can_be_opened(page):
    for path, name in (("first", "skew"), ("sample/bottle", "bottle")):
        drawing = json.loads(page.ask(path)[2])
        assert drawing["name"] == name
        assert len(drawing["strokes"]) > 3


def test_a_coarse_field_comes_before_a_fine_one(page):
    answers = page.steps("compute?page=b&edit=1&size=72", changed(size=72))
    steps = [(step["stage"], step.get("size")) for step in answers]
    steps = [step for step in steps if step != ("surface", 48)]  # only if it is ready before the fine field
    assert steps == [("field", 48), ("field", 72), ("surface", 72), ("done", None)]


def test_an_edit_that_the_same_page_has_overtaken_ends_without_its_result(page):
    page.steps("compute?page=c&edit=5&size=16", changed())
    assert page.steps("compute?page=c&edit=4&size=16", changed()) == [{"stage": "overtaken"}]
    assert page.steps("compute?page=f&edit=1&size=16", changed())[-1]["stage"] == "done"


def test_a_newer_edit_stops_work_that_has_begun(page):
    answers = []

    def ask():
        answers.extend(page.steps("compute?page=d&edit=1&size=192", changed(size=192)))

    older = threading.Thread(target=ask)
    older.start()
    page.ask("next?page=d&edit=2", changed(strokes=[]))
    newer = page.steps("compute?page=d&edit=3&size=16", changed())
    older.join()
    assert [step["stage"] for step in newer] == ["field", "surface", "done"]
    assert answers[-1] == {"stage": "overtaken"} or answers[-1]["stage"] == "done"


@for_each(
    "data, words",
    [
        (changed(strokes=[]), "draw one"),
        (changed(strokes=[stroke | {"mark": "cut"} for stroke in PEBBLE["strokes"]]), "draw one"),
        (b"nothing", "session"),
    ],
)
def test_a_drawing_without_lines_and_a_damaged_one_get_a_message(page, data, words):
    (answer,) = page.steps("compute?page=g&edit=1&size=16", data)
    assert words in answer["message"]


def test_files_are_opened_and_refused(page):
    drawing = b'<svg viewBox="0 0 9 9"><path d="M0 0L9 9M0 9L9 0" stroke="black"/></svg>'
    status, _, body = page.ask("open?name=a.svg", drawing)
    assert (status, len(json.loads(body)["strokes"])) == (200, 2)
    for name, data, words, headers in (
        ("a.png", b"\x89PNG", "picture", {}),
        ("a.svg", b"", "empty", {}),
        ("a.svg", b"<", "simplify", {"Content-Length": "300000000"}),  # before it is read
    ):
        status, _, body = page.ask(f"open?name={name}", data, headers=headers)
        assert (status, words in json.loads(body)["message"]) == (422, True)


def test_it_ends_on_an_interrupt_also_while_it_works():
    with studio() as page:
        assert json.loads(page.ask("first")[2]) is None
        busy = threading.Thread(target=lambda: page.ask("compute?page=a&edit=1&size=192", changed(size=192)))
        busy.start()
        assert page.stop() == 0
        busy.join()
        assert page.process.stderr.read() == ""


def test_a_saved_session_is_opened_by_the_command(tmp_path, capsys):
    saved = tmp_path / "pebble.studio.json"
    saved.write_bytes(changed())
    with studio(str(saved)) as page:
        assert json.loads(page.ask("first")[2])["document"] == json.loads(changed())
    saved.write_bytes(changed(size=1))
    assert invoke(["studio", "--no-browser", str(saved)]) == 1
    assert "$.size: 1 is less" in capsys.readouterr().err


def test_a_port_in_use_and_a_missing_drawing_are_reported(page, capsys):
    port = page.host.split(":")[1]
    assert invoke(["studio", "--no-browser", "--port", port]) == 1
    assert "choose another with --port" in capsys.readouterr().err
    assert invoke(["studio", "--no-browser", "nothing.svg"]) == 1
    assert "nothing.svg" in capsys.readouterr().err


def test_a_missing_package_is_reported_with_its_remedy(monkeypatch, capsys):
    import sys

    monkeypatch.setitem(sys.modules, "uvicorn", None)
    for name in [module for module in sys.modules if module.startswith("crossfield.export.studio.server")]:
        monkeypatch.delitem(sys.modules, name)
    assert invoke(["studio", "--no-browser"]) == 1
    assert "pip install '.[studio]'" in capsys.readouterr().err
