"""The page of the studio, served and open in a browser."""

import pytest
from studio_pages import opened
from studios import studio


@pytest.fixture(scope="module")
def page():
    with studio() as served:
        yield served


@pytest.fixture
def empty(browser, page):
    """The browser on an empty page; what it leaves behind does not ask before it closes."""
    yield opened(browser, page.address)
    browser.execute_script(
        "addEventListener('beforeunload', event => event.stopImmediatePropagation(), true);"
        "sessionStorage.clear()"
    )
