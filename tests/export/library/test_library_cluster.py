"""A library, partly proven, built on a cluster: a scheduler and two workers, one killed during the build."""

import signal
import subprocess
import sys

import pytest
from clusters import cluster
from command_line import invoke
from libraries import content, document, library_of, write_spec

SPEC = """[rungs.tiny]
sizes = [3]
formats = ["nl", "mps"]
[[sketches]]
name = "mouse"
sample = "mouse"
points = "greedy"
[[sketches]]
name = "family"
random = "full"
seeds = "1-2"
points = "proven"
"""

BUILD = """import sys
from crossfield.export.library.building.build import build
from crossfield.export.library.plan.spec import read_spec
spec, folder, address = sys.argv[1:4]
build(read_spec(spec), folder, scheduler=address, progress=lambda line: print(line, flush=True))
"""


@pytest.mark.slow
@pytest.mark.needs("distributed")
def test_a_worker_killed_in_the_middle_loses_nothing_and_nothing_is_made_twice(tmp_path):
    local = library_of(tmp_path, SPEC).folder
    out, lines = tmp_path / "cluster", []
    with cluster(tmp_path) as (address, (first, second)):
        command = [sys.executable, "-c", BUILD, str(tmp_path / "spec.toml"), str(out), address]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            for line in process.stdout:
                if " entries: " in line:
                    lines.append(line.strip())
                    if len(lines) == 8:
                        first.kill()
            assert process.wait() == 0
        assert first.wait() == -signal.SIGKILL
        assert second.poll() is None
    names = [line.split(": ")[1] for line in lines]
    assert len(lines) > 20
    assert sorted(names) == sorted(document(local, "library")["entries"])
    assert [int(line.split()[0]) for line in lines] == list(range(1, len(names) + 1))
    assert content(out) == content(local)


@pytest.mark.needs("distributed")
def test_a_scheduler_that_does_not_answer_is_one_line(tmp_path, capfd):
    build = ["library", "build", str(write_spec(tmp_path, SPEC)), "-o", str(tmp_path / "out"), "--scheduler"]
    for address in ("nonsense", "ftp://127.0.0.1:1"):
        assert invoke([*build, address]) == 1
        shown = capfd.readouterr().err
        assert shown.count("\n") == 1
        assert "no scheduler answers at" in shown
    assert not list((tmp_path / "out").glob("cf_*"))
