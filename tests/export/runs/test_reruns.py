"""A run over the files of an earlier one: whatever ends it, a folder has whole sets of files, old or new."""

import json
import re
import shutil
import signal
import subprocess
import sys

import crossfield as cf
import pytest
from children import complaints
from command_line import invoke
from folders import LIST
from PIL import Image

RUN = """
import sys, crossfield as cf
show = lambda line: print(line, flush=True)
cf.run(cf.sample("mouse", 8), sys.argv[1], limits=cf.Limits(float(sys.argv[2]), threads=int(sys.argv[3])),
       progress=show)
"""
FIELDS = ["field.npz", "field.json", "field.rawfield", "field.obj", "field.sings", "lowest.npz", "mask.png"]
PICTURES = [
    *("overview.png", "field.png", "crosses.png", "angle.png", "instance.png", "overlay.svg", "overlay.png")
]


@pytest.fixture(scope="module")
def earlier(tmp_path_factory):
    """The folder of a run of another instance, and its files."""
    folder = tmp_path_factory.mktemp("earlier")
    cf.run(cf.sample("skew", 4), folder, limits=cf.Limits(0.2))
    return folder, files(folder)


def files(folder):
    paths = [path for path in folder.iterdir() if path.is_file() and path.name != LIST]
    return {path.name: path.read_bytes() for path in paths}


def end_at(folder, line, number, seconds="0.5", threads="1"):
    """Run into the folder, and send a signal after a line of this start; return exit code and complaints."""
    command = [sys.executable, "-c", RUN, folder, seconds, threads]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        while not child.stdout.readline().startswith(line):
            assert child.poll() is None
        child.send_signal(number)
        err = child.communicate()[1]
    return child.returncode, complaints(err)


def assert_whole(folder, old):
    """Every kind of file is that of one run, can be read, and the page names existing files only."""
    new = files(folder)
    for kind in (FIELDS[:-1], PICTURES):
        assert len({new.get(name) == old[name] for name in kind if name in new or name in old}) == 1
    for name in ("field.npz", "field.json", "lowest.npz"):
        cf.read_field(folder / name)
    for path in folder.glob("[!.]*.png"):
        with Image.open(path) as picture:
            picture.verify()
    for path in folder.glob("certificate.npz"):
        cf.read_certificate(path)
    for manifest in (folder / "models").glob("*.manifest.json"):
        cf.read_manifest(manifest).problem()
    links = re.findall(r'href="([^"#]+)"', new["index.html"].decode())
    assert links
    assert [link for link in links if not (folder / link).exists()] == []


@pytest.mark.slow
def test_a_run_that_is_killed_leaves_the_files_of_the_earlier_one(earlier, tmp_path):
    """Pictures, page and report come last; the next run removes what is unfinished."""
    source, old = earlier
    folder = shutil.copytree(source, tmp_path / "run")
    code, _ = end_at(folder, "drawing field", signal.SIGKILL)
    assert code == -signal.SIGKILL
    assert_whole(folder, old)
    new = files(folder)
    assert all(new[name] == old[name] for name in (*PICTURES, "index.html", "report.json"))
    cf.run(cf.sample("skew", 4), folder, limits=cf.Limits(0.2), stop=lambda: True)
    assert [path for path in folder.rglob(".*") if path.name != LIST] == []


@pytest.mark.slow
def test_ctrl_c_while_it_draws_leaves_all_files_of_the_earlier_run(earlier, tmp_path):
    source, old = earlier
    folder = shutil.copytree(source, tmp_path / "run")
    assert end_at(folder, "drawing field", signal.SIGINT) == (0, "")
    assert files(folder) == old
    new = files(folder / "new-results")
    assert json.loads(new["report.json"])["interrupted"] == "drawing"
    drawn = [name for name in PICTURES if name in new]
    assert drawn[0] == "overview.png"
    assert len(drawn) < len(PICTURES)
    assert_whole(folder / "new-results", old)


def test_a_folder_in_the_place_of_a_file_stops_a_command_before_its_work(tmp_path, capsys):
    (tmp_path / "mouse.proof.certificate.npz").mkdir()
    assert invoke(["prove", "mouse", "--size", "4", "-o", str(tmp_path), "--time-limit", "60"]) == 1
    assert "mouse.proof.certificate.npz: is a folder; choose another folder" in capsys.readouterr().err
    assert files(tmp_path) == {}
