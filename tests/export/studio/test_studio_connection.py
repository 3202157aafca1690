"""What the page shows of a server that hangs, stops or loses a process, and how it goes on."""

from __future__ import annotations

import os
import signal

import pytest
from browsing import find
from children import running
from studio_pages import banner, document, opened, pebble, settled, until, write
from studios import PEBBLE, studio

pytestmark = pytest.mark.slow


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
