"""Progress without a terminal: one line every few seconds, and none for short work."""

import threading

import pytest
from crossfield.export.cli import progress_lines
from crossfield.export.cli.output import progress
from crossfield.export.cli.progress_lines import EVERY, ProgressLines


def test_a_line_is_due_every_few_seconds_and_shows_the_current_step():
    now, written = [100.0], []
    lines = ProgressLines(written.append, lambda: now[0])
    assert lines.seconds_left() == EVERY
    for passed, text in enumerate(["a", "b", "c", "d", "e", "f", "f", "g", "g", "g", "g", "g"]):
        now[0] = 100.0 + passed
        lines.update(text)
        lines.write_if_due()
    assert written == ["[5 s] f", "[10 s] g"]
    assert lines.seconds_left() == EVERY - 1.0
    now[0] += 30  # six lines were due; only one is written
    lines.write_if_due()
    lines.write_if_due()
    assert written[2:] == ["[41 s] g"]


def test_a_thread_writes_the_lines_and_ends_with_the_work(monkeypatch):
    monkeypatch.setattr(progress_lines, "EVERY", 0.01)
    written, twice = [], threading.Event()

    def write(line):
        written.append(line)
        if len(written) > 1:
            twice.set()

    before = threading.active_count()
    with progress_lines.progress_lines(write) as update:
        update("solving")
        assert twice.wait(60)
    assert threading.active_count() == before
    assert "s] solving" in written[1]


def test_work_continues_after_the_stream_is_closed(monkeypatch):
    monkeypatch.setattr(progress_lines, "EVERY", 0.01)
    called = threading.Event()

    def write(_line):
        called.set()
        raise BrokenPipeError

    with progress_lines.progress_lines(write):
        assert called.wait(60)


@pytest.mark.parametrize("quiet", [False, True])
def test_lines_go_to_standard_error_unless_quiet(monkeypatch, capsys, quiet):
    monkeypatch.setattr(progress_lines, "EVERY", 0.01)
    lines = []
    with progress(quiet=quiet) as show:
        show("solving\x1b[2J")
        while not quiet and not lines:
            lines = capsys.readouterr().err.splitlines()[-1:]
    out, err = capsys.readouterr()
    assert out == ""
    assert all(line.endswith(("s] starting", "s] solving\\x1b[2J")) for line in [*lines, *err.splitlines()])
    assert not (quiet and err)
