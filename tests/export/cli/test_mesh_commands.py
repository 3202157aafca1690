"""Meshes on the command line: from a file to an optimum and back, and refused where pixels are needed."""

import json
import subprocess
import sys
import time
from pathlib import Path

import crossfield as cf
import numpy as np
import pytest
from crossfield.export.cli.app import invoke
from crossfield.export.cli.mesh_options import SKETCHES_ONLY
from loops import for_each
from meshes import box, flat_sheet, write_obj


@pytest.fixture(autouse=True)
def files(tmp_path, monkeypatch):
    """The .obj of a cube, its instance, and a field on it, in the current folder."""
    monkeypatch.chdir(tmp_path)
    write_obj(Path("cube.obj"), box())
    instance = cf.read_mesh("cube.obj", sharp=35)
    cf.write_instance(instance, "cube.json")
    cf.write_field(cf.CrossField.from_lines(instance, np.zeros(12), np.full(12, np.pi / 2)), "start.json")


EXPORT = """
import resource, sys
from crossfield.export.cli.app import invoke
code = invoke(["export", "sheet.obj", "-f", "milp", "-F", "mps", "-o", "out", "-q"])
print(code, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.slow
def test_a_mesh_of_100000_faces_is_exported_within_30_seconds_and_2_gigabytes():
    write_obj(Path("sheet.obj"), flat_sheet(224, 224))
    begin = time.monotonic()
    shown = subprocess.run([sys.executable, "-c", EXPORT], capture_output=True, text=True, check=True).stdout
    code, kilobytes = map(int, shown.split())
    assert code == 0
    assert time.monotonic() - begin < 30
    assert kilobytes < 2e6


def line_of(capsys):
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    return shown


@for_each("crosses", ["orthogonal", "skewed"])
def test_a_mesh_is_exported_verified_solved_and_read(crosses, capsys):
    """Crosses along all edges of a cube have the energy 0, and a singularity at each corner."""
    capsys.readouterr()
    assert invoke(["instance", "cube.obj", "--sharp", "35", "--crosses", crosses, "-o", "i.json"]) == 0
    assert ("orthogonal" in capsys.readouterr().out) == (crosses == "orthogonal")
    instance = cf.read_instance("i.json")
    start = cf.CrossField.from_lines(instance, np.zeros(12), np.full(12, np.pi / 2))
    cf.write_field(start, "s.json")
    formats = [word for name in ("lp", "mps", "nl", "mod") for word in ("-F", name)]
    chosen = ["-f", "milp", "-f", "qp", *formats, "--start", "s.json", "-o", "out"]
    assert invoke(["export", "i.json", *chosen, "--json"]) == 0
    counts = json.loads(capsys.readouterr().out)[0]["counts"]
    assert (counts["faces"], counts["pairs"], counts["stroke_faces"]) == (12, 18, 12)
    assert invoke(["verify", "out", "-p", "highs", "-p", "casadi"]) == 0
    assert invoke(["solve", "i.json", "-f", "milp", "--start", "s.json", "-o", "solved"]) == 0
    manifest = "out/cube.milp-mccormick.manifest.json"
    solution = next(Path("solved").glob("*.sol"))
    for suffix in ("json", "npz"):
        assert invoke(["read", str(solution), "--manifest", manifest, "-o", f"field.{suffix}"]) == 0
        field = cf.read_field(f"field.{suffix}")
        assert field.energy().total == pytest.approx(0, abs=1e-9)
        assert field.singularities.index.tolist() == [0.25] * 8


def test_the_options_of_a_mesh_and_of_a_sketch_are_kept_apart(capsys):
    for arguments, message in (
        (["mouse", "--sharp", "35"], "mouse: is no mesh file; leave --sharp, --directions and --weights out"),
        (["cube.json", "--weights", "dual"], "cube.json: is no mesh file"),
        (["cube.obj", "--size", "9"], "cube.obj: is a mesh; leave out the options that read a sketch"),
        (["cube.obj", "--view", "top"], "cube.obj: is a mesh; leave out the options that read a sketch"),
        (["none.obj"], "none.obj: cannot be read: no such file"),
    ):
        assert invoke(["instance", *arguments, "-o", "x.json"]) == 1
        assert message in line_of(capsys)
    assert invoke(["instance", "cube.obj", "--stroke-weight", "3", "-o", "x.npz"]) == 0
    assert cf.read_instance("x.npz").stroke_weight == 3
    assert invoke(["instance", "mouse", "--size", "8", "--crosses", "orthogonal", "-o", "x.json"]) == 0
    assert cf.read_instance("x.json").orthogonal


@for_each("command", SKETCHES_ONLY)
def test_commands_for_pixels_refuse_meshes_in_one_line(command, capsys):
    output = [] if command == "studio" else ["-o", "x.png" if command == "draw" else "x"]
    sources = {"draw": ["start.json", "cube.json"], "studio": ["cube.obj"]}
    for source in sources.get(command, ["cube.obj", "cube.json"]):
        assert invoke([command, source, *output]) == 1
        assert "mesh" in line_of(capsys)
    assert not Path("x").exists()
    assert not Path("x.png").exists()
