"""Fixtures of several tests of libraries."""

import shutil

import pytest
from browsing import show
from oracles import browser as browser_program


@pytest.fixture(scope="module")
def short_searches():
    """Builds use one round of search, because the quality of their fields does not matter here."""
    from crossfield.export.library.ledger import points

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(points, "_ROUNDS", 1)
        yield


@pytest.fixture(scope="module")
def chromium():
    """A headless Chromium; its logs are kept."""
    from selenium import webdriver

    driver = shutil.which("chromedriver")
    options = webdriver.ChromeOptions()
    options.binary_location = browser_program()
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=driver))
    yield browser
    browser.quit()


@pytest.fixture
def browser(chromium):
    """The browser as a desktop in light mode, with a fresh page and empty logs."""
    show(chromium)
    chromium.get("about:blank")
    for log in ("browser", "performance"):
        chromium.get_log(log)
    return chromium
