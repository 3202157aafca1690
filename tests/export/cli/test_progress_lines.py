"""Progress without a terminal: one line every few seconds, and none for short work."""

import re
import threading

import pytest
import typer
from crossfield.export.cli import output
from crossfield.export.cli.output import show_progress


@pytest.mark.parametrize("quiet", [False, True])
def test_lines_with_the_current_step_go_to_standard_error_unless_quiet(monkeypatch, capsys, quiet):
    monkeypatch.setattr(output, "EVERY", 0.01)
    lines, before = [], threading.active_count()
    with show_progress(quiet=quiet) as show:
        show("reading")
        show("solving\x1b[2J")
        while not quiet and not lines:
            lines = capsys.readouterr().err.splitlines()[-1:]
    assert threading.active_count() == before
    out, err = capsys.readouterr()
    assert out == ""
    assert all(
        re.fullmatch(r"\[\d+ s\] (starting|reading|solving\\x1b\[2J)", line)
        for line in [*lines, *err.splitlines()]
    )
    assert not (quiet and err)


def test_short_work_prints_no_line(capsys):
    with show_progress(quiet=False) as show:
        show("solving")
    assert capsys.readouterr() == ("", "")


def test_work_continues_after_the_stream_is_closed(monkeypatch):
    monkeypatch.setattr(output, "EVERY", 0.01)
    called = threading.Event()

    def echo(_line, **_options):
        called.set()
        raise BrokenPipeError

    monkeypatch.setattr(typer, "echo", echo)
    with show_progress(quiet=False):
        assert called.wait(60)
