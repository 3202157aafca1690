"""Who waits without a terminal is told what is being done: a line every few seconds, none of short work."""

import threading

import pytest
from crossfield.export.cli import telling
from crossfield.export.cli.output import progress
from crossfield.export.cli.telling import EVERY, Teller


def test_a_line_is_due_every_few_seconds_and_says_what_is_done_then():
    now, said = [100.0], []
    teller = Teller(said.append, lambda: now[0])
    assert teller.left() == EVERY
    for passed, text in enumerate(["a", "b", "c", "d", "e", "f", "f", "g", "g", "g", "g", "g"]):
        now[0] = 100.0 + passed
        teller.now(text)
        teller.look()
    assert said == ["[5 s] f", "[10 s] g"]
    assert teller.left() == EVERY - 1.0
    now[0] += 30  # nobody looked for long: one line, not six
    teller.look()
    teller.look()
    assert said[2:] == ["[41 s] g"]


def test_lines_come_by_themselves_and_end_with_the_work(monkeypatch):
    monkeypatch.setattr(telling, "EVERY", 0.01)
    said, twice = [], threading.Event()

    def say(line):
        said.append(line)
        if len(said) > 1:
            twice.set()

    before = threading.active_count()
    with telling.telling(say) as now:
        now("solving")
        assert twice.wait(60)
    assert threading.active_count() == before
    assert "s] solving" in said[1]


def test_work_goes_on_when_nobody_reads_the_lines(monkeypatch):
    monkeypatch.setattr(telling, "EVERY", 0.01)
    told = threading.Event()

    def say(_line):
        told.set()
        raise BrokenPipeError

    with telling.telling(say):
        assert told.wait(60)


@pytest.mark.parametrize("quiet", [False, True])
def test_lines_go_to_standard_error_unless_it_shall_be_quiet(monkeypatch, capsys, quiet):
    monkeypatch.setattr(telling, "EVERY", 0.01)
    lines = []
    with progress(quiet=quiet) as show:
        show("solving\x1b[2J")
        while not quiet and not lines:
            lines = capsys.readouterr().err.splitlines()[-1:]
    out, err = capsys.readouterr()
    assert out == ""
    assert all(line.endswith(("s] starting", "s] solving\\x1b[2J")) for line in [*lines, *err.splitlines()])
    assert not (quiet and err)
