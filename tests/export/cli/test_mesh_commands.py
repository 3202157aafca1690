"""Meshes on the command line: from a file to an optimum and back, and refused where pixels are needed."""

import subprocess
import sys
from pathlib import Path

import crossfield as cf
import numpy as np
import pytest
from command_line import invoke
from loops import for_each
from meshes import box, flat_sheet, mesh_of, write_obj

ARGUMENTS = ["export", "sheet.obj", "-f", "milp", "-F", "mps", "-o", "out"]
EXPORT = """
import atexit, resource, runpy
atexit.register(lambda: print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss))
runpy.run_module("crossfield", run_name="__main__")
"""


@pytest.mark.slow
def test_a_mesh_of_100000_faces_is_exported_within_2_gigabytes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_obj(Path("sheet.obj"), flat_sheet(224, 224))
    command = [sys.executable, "-c", EXPORT, *ARGUMENTS]
    shown = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert int(shown.splitlines()[-1]) < 2e6  # kilobytes


@for_each(
    "words,options",
    [
        ("--no-boundary --crosses skewed", {"boundary": False, "orthogonal": False}),
        ("--boundary --sharp 30 --weights dual", {"sharp": 30, "weights": "dual"}),
        ("--sharp 1e-9 --sharp-weight 0.5", {"sharp": 1e-9, "sharp_weight": 0.5}),
    ],
)
def test_options_of_meshes_are_those_of_read_mesh(words, options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_obj(Path("sheet.obj"), flat_sheet(2, 2))
    assert invoke(["instance", "sheet.obj", *words.split(), "-o", "i.json"]) == 0
    assert cf.read_instance("i.json").sha256 == cf.read_mesh("sheet.obj", **options).sha256


def test_sharp_edges_are_written_for_quadwild_and_read_back(tmp_path, monkeypatch):
    """A sheet folded into a step: its first inner edge is concave, its second one convex."""
    monkeypatch.chdir(tmp_path)
    vertices = [[x, y, z] for x, z in ((0, 0), (1, 0), (1, 1), (2, 1)) for y in (0, 1)]
    faces = [corners for k in (0, 2, 4) for corners in ([k, k + 2, k + 3], [k, k + 3, k + 1])]
    write_obj(Path("step.obj"), mesh_of(vertices, faces))
    assert invoke(["instance", "step.obj", "--sharp", "35", "-o", "step.sharp"]) == 0
    count, *rows = Path("step.sharp").read_text().split()
    inner = ["0,0,1", "1,2,1", "0,3,2", "1,5,2"]
    assert int(count) == len(rows) == 12
    assert [row for row in rows if row in inner] == inner
    assert sum(row[0] == "0" for row in rows) == 2
    again = cf.read_mesh("step.obj", boundary=False, directions="step.sharp")
    assert again.sha256 == cf.read_mesh("step.obj", sharp=35).sha256
    assert invoke(["instance", "step.obj", "-o", "step.json"]) == 0
    assert invoke(["instance", "step.json", "-o", "again.sharp"]) == 1


def test_singularities_of_a_file_are_prescribed_in_models_and_kept_by_answers(tmp_path, monkeypatch, capsys):
    """The corners of a cube without its first one, whose index goes to the middle of its top."""
    monkeypatch.chdir(tmp_path)
    write_obj(Path("cube.obj"), box(2))
    assert invoke(["instance", "cube.obj", "--sharp", "35", "--stroke-weight", "30", "-o", "i.json"]) == 0
    instance = cf.read_instance("i.json")
    assert instance.stroke_weight == pytest.approx(30)
    corners = np.nonzero(np.isin(instance.mesh.vertices, (0, 1)).all(axis=1))[0].tolist()
    top = instance.mesh.vertices.tolist().index([0.5, 0.5, 1])
    rows = [f"{corners[0]} 0", f"{top} 1", *(f"{corner} 1" for corner in corners[1:])]
    Path("wanted.sings").write_text("\n".join(["4 9", *rows]) + "\n")
    assert invoke(["instance", "i.json", "--indices", "wanted.sings", "-o", "part.json"]) == 0
    assert invoke(["instance", "part.json", "-o", "again.npz"]) == 0
    assert cf.read_instance("again.npz").sha256 == cf.read_instance("part.json").sha256 != instance.sha256
    assert invoke(["export", "part.json", "-o", "out"]) == 0
    assert [path.name for path in sorted(Path("out").glob("*.lp"))] == [
        "cube.milp-cycle.lp",
        "cube.miqp-cycle.lp",
    ]
    assert invoke(["verify", "out", "-p", "highs", "-p", "casadi"]) == 0
    manifest = cf.read_manifest("out/cube.milp-cycle.manifest.json")
    problem, counts = manifest.problem(), manifest.document["counts"]
    assert (counts["faces"], counts["pairs"], counts["stroke_faces"]) == (48, 72, 24)
    cf.write_field(cf.solve(problem, "highs").field, "solved.rawfield")
    limit = ["--time-limit", "1", "-o"]
    assert invoke(["solve", "part.json", "-m", "search", *limit, "searched"]) == 0
    assert invoke(["prove", "part.json", *limit, "proven"]) == 0
    for number, path in enumerate(Path().glob("*/*.field.npz")):
        cf.write_field(cf.read_field(path), f"{number}.rawfield")
    for path in ("solved", "0", "1"):
        written = Path(f"{path}.sings").read_text().splitlines()
        assert {*rows[1:]} <= {*written[1:]}
        assert not any(row.startswith(f"{corners[0]} ") for row in written[1:])
        assert cf.read_field(f"{path}.rawfield", on=problem.instance)
    capsys.readouterr()
    for text, message in (("4 1\n", "4 0, the number"), ("5 0\n", "4 0"), ("4 1\n3 x\n", "line 2")):
        Path("wrong.sings").write_text(text)
        assert invoke(["instance", "i.json", "--indices", "wrong.sings", "-o", "wrong.json"]) == 1
        assert message in capsys.readouterr().err
    assert invoke(["export", "part.json", "-f", "milp", "-o", "wrong"]) == 1
    assert "lets vertices have any index" in capsys.readouterr().err
    assert invoke(["solve", "part.json", "-m", "power", "-o", "wrong"]) == 1
    assert "prescribed indices; use greedy, search, prove" in capsys.readouterr().err
