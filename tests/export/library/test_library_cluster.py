"""A library, partly proven, built on a cluster: a scheduler and two workers, one killed during the build."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from clusters import cluster
from crossfield.export.cli.app import invoke
from crossfield.export.library.building.build import build
from crossfield.export.library.plan.spec import read_spec
from libraries import content

SPEC = """format = "crossfield-library-spec"
version = 1
title = "a library for tests of clusters"

[rungs.tiny]
sizes = [3]
formats = ["nl", "mps"]
prove = false

[rungs.medium]
sizes = [6]
formats = ["nl", "mps"]
compress = true

[[sketches]]
name = "mouse"
sample = "mouse"

[[sketches]]
name = "skew"
sample = "skew"

[[sketches]]
name = "family"
random = "full"
seeds = "1-2"
share = 0.03
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
    spec = tmp_path / "spec.toml"
    spec.write_text(SPEC)
    out, lines = tmp_path / "cluster", []
    with cluster(tmp_path) as (address, (first, second)):
        command = [sys.executable, "-c", BUILD, str(spec), str(out), address]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            for line in process.stdout:
                if " entries: " in line:
                    lines.append(line.strip())
                    if len(lines) == 20:
                        first.kill()
            assert process.wait() == 0
        assert first.wait() == -signal.SIGKILL
        assert second.poll() is None

    local = build(read_spec(spec), tmp_path / "local")
    names = [line.split(": ")[1] for line in lines]
    assert len(lines) > 40
    assert len(names) == len(set(names))
    assert set(names) == set(local.document["entries"])
    assert [int(line.split()[0]) for line in lines] == list(range(1, len(names) + 1))
    assert content(out) == content(local.folder)


@pytest.mark.needs("distributed")
def test_a_scheduler_that_does_not_answer_is_one_line(tmp_path, capfd):
    spec = tmp_path / "spec.toml"
    spec.write_text(SPEC)
    for address in ("nonsense", "ftp://127.0.0.1:1"):
        assert (
            invoke(["library", "build", str(spec), "-o", str(tmp_path / "out"), "--scheduler", address]) == 1
        )
        shown = capfd.readouterr().err
        assert len(shown.splitlines()) == 1
        assert "no scheduler answers at" in shown
    assert not list(Path(tmp_path / "out").glob("cf_*"))
