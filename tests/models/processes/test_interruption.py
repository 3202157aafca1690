"""Ctrl-C and a run: its end, the kept results, and that no process is left behind."""

import json
import os
import signal
import subprocess
import sys
from contextlib import contextmanager

import crossfield as cf
import pytest
from children import all_end, complaints, descendants, running
from crossfield.models.proof.descent import descent
from folders import contents

FIELDS = {"field.npz", "field.json", "field.rawfield", "field.obj", "field.sings"}

RUN = """
import sys, crossfield as cf
show = lambda line: print(line, flush=True)
report = cf.run(cf.sample("mouse", 10), sys.argv[1], limits=cf.Limits(float(sys.argv[2])), progress=show)
"""


@contextmanager
def started(command, first=None):
    """A process that has printed a line with this start; in the end no child of it is left."""
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        while first and not (line := process.stdout.readline()).startswith(first):
            assert line, process.communicate()
        theirs = descendants(process.pid)
        try:
            yield process
        finally:
            process.kill()
    assert all_end(theirs | {pid for pid, (_, group) in running().items() if group == process.pid})


def press(process, times=1):
    """Exit code and complaints of a process after Ctrl-C."""
    for _ in range(times):
        os.killpg(process.pid, signal.SIGINT)
    err = process.communicate()[1]
    return process.returncode, complaints(err)


def pictures(folder):
    return {path.stem for path in folder.glob("*.png")} - {"mask"}  # which is written first


@pytest.mark.slow
def test_ctrl_c_in_the_search_ends_the_run_with_its_best_field(tmp_path):
    with started([sys.executable, "-c", RUN, tmp_path, "600"], "search: energy") as process:
        assert press(process) == (0, "")
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["interrupted"] == "search"
    by_method = {row["method"]: row for row in report["methods"]}
    smooth = {"power", "power + QP", "polyvector", "polyvector + QP", "bend"}
    # HiGHS works beside the search.
    assert set(by_method) - {"MILP"} == {"start", "greedy", "search"} | smooth
    assert by_method["search"]["interrupted"] is True
    assert cf.read_field(tmp_path / "lowest.npz").energy().total == pytest.approx(
        min(row["energy_2_norm"] for row in report["methods"]), rel=1e-9
    )
    written = {name for name in contents(tmp_path) if "/" not in name}
    assert written == {*FIELDS, "lowest.npz", "mask.png", "index.html", "report.json"}


def test_ctrl_c_in_a_search_ends_the_proof_around_it(monkeypatch):
    pressed = []
    monkeypatch.setattr(descent, "MOST_LABELS", 0)  # no level follows the first: the proof searches

    def press_once(line):
        if line.startswith("search:") and not pressed:
            pressed.append(line)
            signal.raise_signal(signal.SIGINT)

    proof = cf.prove(cf.sample("mouse", 9), jobs=1, progress=press_once)  # its search waits for no clock
    assert (len(pressed), proof.ended) == (1, "interrupted")


@pytest.mark.slow
def test_ctrl_c_twice_ends_at_once_and_leaves_whole_files(tmp_path):
    with started([sys.executable, "-c", RUN, tmp_path, "600"], "search: energy") as process:
        code, err = press(process, times=2)
    assert not list(tmp_path.rglob(".*.part"))
    assert pictures(tmp_path) == set()
    if (tmp_path / "report.json").exists():
        assert (code, err) == (0, "")
        assert json.loads((tmp_path / "report.json").read_text())["interrupted"] == "search"
    else:
        assert "KeyboardInterrupt" in err
