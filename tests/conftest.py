"""Puts the folder `support` on the path, so that test modules can import `cases` and `oracles`;
says which tests were left out, and why.
"""

import os
import shutil
import signal
import sys
from collections import Counter
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

# pytest-xdist gives every core a test; linear algebra with as many threads in each would only wait for one
# another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent / "support"))

import pytest
from hypothesis import HealthCheck, settings
from places import ROOT

# The same examples in every run: a chance find must not decide whether a change passes.
# `--hypothesis-profile=fuzz` draws others. Neither must the clock: how long an example takes on a busy
# machine says nothing.
settings.register_profile(
    "same", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("fuzz", settings.get_profile("same"), derandomize=False, print_blob=True)
settings.load_profile("same")

# A shell lets what runs in its background ignore Ctrl-C, and children inherit that: tests press it.
signal.signal(signal.SIGINT, signal.default_int_handler)

LEFT_OUT = pytest.StashKey[dict[str, int]]()
LONGEST = {"conformance", "project"}
"""Folders with the files that take longest."""


@pytest.fixture
def hidden(monkeypatch, tmp_path_factory):
    """A function that hides programs by name: `hidden("glpsol", "cbc")`.

    The test, and the processes that it starts, then find no program of these names on PATH and every other
    one. A folder that holds one of them is replaced on PATH by a folder of links to the rest.
    """

    def hide(*names):
        folders = []
        for folder in map(Path, os.get_exec_path()):
            if any(shutil.which(name, path=str(folder)) for name in names):
                rest = tmp_path_factory.mktemp("path")
                for program in folder.iterdir():
                    if program.name.removesuffix(".exe") not in names:
                        (rest / program.name).symlink_to(program)
                folders.append(rest)
            else:
                folders.append(folder)
        monkeypatch.setenv("PATH", os.pathsep.join(map(str, folders)))

    return hide


@pytest.fixture(scope="session")
def docs_module():
    """A function that imports a program of docs/ by its name."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "docs")
        patch.delitem(
            sys.modules, ROOT.name, raising=False
        )  # pytest imports the checkout by its folder's name
        yield import_module


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(config, items):
    """Marks who needs a program; leaves out, after -m and -k have chosen, who needs an absent one;
    and counts who is left out.
    """
    for item in items:
        if "chromium" in item.fixturenames:
            item.add_marker(pytest.mark.needs("chromium"))
        if item.get_closest_marker("needs"):
            item.add_marker("oracles")
    slow = sum("slow" in item.keywords for item in items)
    long = {item.path for item in items if "slow" in item.keywords}
    result = yield
    reasons = [_absent(item) for item in items]
    config.hook.pytest_deselected(items=[item for item, reason in zip(items, reasons, strict=True) if reason])
    items[:] = [item for item, reason in zip(items, reasons, strict=True) if not reason]
    config.stash[LEFT_OUT] = dict(Counter(filter(None, reasons)))
    # Workers take whole files in this order; long files at the end would keep one of them busy alone.
    items.sort(key=lambda item: (item.path not in long, item.path.parent.name not in LONGEST))
    if slow and config.option.markexpr == "not slow" and not config.option.keyword:
        config.stash[LEFT_OUT]["slow; run them with -m slow"] = slow
    return result


def pytest_runtest_setup():
    """HiGHS refuses another number of threads than that of the first solve in the process."""
    if highspy := sys.modules.get("highspy"):
        highspy.Highs.resetGlobalScheduler(True)


def _absent(item):
    marks = list(item.iter_markers("needs"))
    if not marks:
        return ""
    from oracles import absence

    return next(filter(None, (absence(*mark.args) for mark in marks)), "")


def pytest_collection_finish(session):
    """Compiles the functions of proofs, or waits for the process that does: tests have limits of time.
    Smoke tests need none of them.
    """
    option = session.config.option
    proofs = find_spec("crossfield.models.proof")  # tests of the core alone do without
    if proofs and session.items and not option.collectonly and not option.markexpr.startswith("smoke"):
        from crossfield.models.processes.compilation import is_all_compiled
        from crossfield.models.proof.compiling import compile_all

        for orthogonal in (False, True):
            compile_all(orthogonal)
        assert is_all_compiled(), "compile_all leaves functions of proofs out"


def pytest_sessionfinish(session):
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["left_out"] = session.config.stash.get(LEFT_OUT, {})


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    """Report the tests that a worker of pytest-xdist skipped; the process on the terminal collects none."""
    node.config.stash[LEFT_OUT] = getattr(node, "workeroutput", {}).get("left_out", {})


def pytest_terminal_summary(terminalreporter, config):
    for reason, count in sorted(config.stash.get(LEFT_OUT, {}).items()):
        terminalreporter.write_line(f"LEFT OUT [{count}] {reason}")


@pytest.fixture(scope="module")
def chromium():
    """A headless Chromium that keeps logs, and waits for pages: under load, its driver alone does not."""
    from oracles import browser as browser_program
    from selenium import webdriver
    from selenium.webdriver.support.ui import WebDriverWait

    class Patient(webdriver.Chrome):
        def get(self, url):
            super().get(url)
            state = "return document.readyState"
            WebDriverWait(self, 200).until(lambda page: page.execute_script(state) == "complete")

    driver = shutil.which("chromedriver")
    options = webdriver.ChromeOptions()
    options.binary_location = browser_program()
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    browser = Patient(options=options, service=webdriver.ChromeService(executable_path=driver))
    yield browser
    browser.quit()


@pytest.fixture
def browser(chromium):
    """The browser as a desktop in light mode, with a fresh page and empty logs."""
    from browsing import show

    show(chromium)
    chromium.get("about:blank")
    for log in ("browser", "performance"):
        chromium.get_log(log)
    return chromium
