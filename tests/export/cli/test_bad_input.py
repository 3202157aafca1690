"""Bad input on the command line: exit code 1, one line that names file and reason, and no new files."""

import json
import re
import subprocess
import sys
from pathlib import Path

import crossfield as cf
import numpy as np
import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.models.instance.symmetries import turned
from crossfield.models.written_files import LIST
from loops import for_each
from PIL import Image, ImageDraw

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 60 40">{}</svg>'


def listing(folder):
    return {path: path.stat().st_size for path in sorted(folder.rglob("*"))}


PLAN = re.compile(r"\Asearches take at most .+ s \(.+\); compiling, files and pictures take more\n\Z")
"""Line that `run` prints after reading the sketch."""


@pytest.fixture
def refused(tmp_path, capsys):
    """Function that runs a command line that must fail, and returns its one line of error."""

    def run(*arguments):
        before = listing(tmp_path)
        code = invoke([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        err = complaints(err)
        assert code == 1
        assert PLAN.sub("", out) == ""
        assert err.startswith("crossfield: ")
        assert err.count("\n") == 1
        assert listing(tmp_path) == before
        return err.removeprefix("crossfield: ")

    return run


@pytest.fixture
def instance():
    mask = np.ones((2, 2), dtype=bool)
    return cf.Instance.on_pixels(
        "tiny", mask, np.array([[0, 0], [1, 1]]), np.array([0.3, 1.2]), np.array([1.0, 0.5])
    )


def picture(*boxes, lines=(), paper=0, size=(60, 40)):
    image = Image.new("L", size, paper)
    for box in boxes:
        ImageDraw.Draw(image).rectangle(box, fill=255)
    for line in lines:
        ImageDraw.Draw(image).line(line, fill=0, width=3)
    return image


PICTURES = {
    "sketch.png": picture(lines=[(5, 5, 55, 35), (5, 35, 55, 5)], paper=255),
    "blank.png": picture(paper=255),
    "small.png": picture((0, 0, 9, 9), size=(50, 40)),
    "off.png": picture((27, 0, 33, 4)),
    "black.png": picture(),
}


SKETCHES = {
    "words.png": (b"these are words", "not a whole picture"),
    "bare.svg": (SVG.format("").encode(), "no stroke"),
    "broken.scap": (b"#60\t40\n@1\n{\n#1\t1\n", "does not end"),
}
"""The other faults of sketches: tests/models/sketch/test_sketch.py."""
INSTANCES = {
    "nan.json": (lambda d: d["strokes"][0].__setitem__(2, float("nan")), "theta is not a finite number"),
    "maskless.json": (lambda d: d.pop("mask"), "mask"),
}
"""The other faults of instances: tests/models/instance/test_instance_file.py."""


@pytest.fixture
def files(tmp_path, monkeypatch, instance):
    """Change to a folder with sketches, masks, instances and a field, most of them damaged."""
    monkeypatch.chdir(tmp_path)
    for name, image in PICTURES.items():
        image.save(name)
    for name, (content, _) in SKETCHES.items():
        Path(name).write_bytes(content)
    Path("half.png").write_bytes(Path("sketch.png").read_bytes()[:150])
    Path("tiny.txt").write_text("text")
    for suffix in (".json", ".npz"):
        whole = cf.write_instance(instance, f"tiny{suffix}").read_bytes()
        Path(f"cut{suffix}").write_bytes(whole[:-40])
    for name, (change, _) in INSTANCES.items():
        document = json.loads(Path("tiny.json").read_text())
        change(document)
        Path(name).write_text(json.dumps(document))
    cf.write_field(cf.greedy_field(turned(instance)), "other.npz")


NO_SUCH_FORMULATION = (
    "there is no formulation 'milp-mcormick' (is it milp-mccormick?); choose one of minlp-parity, "
)
REFUSED = [
    *((f"{command} {name}", f"{name}: ", reason)
      for name, (_, reason) in SKETCHES.items() for command in ("run", "instance -o out.json")),
    *((f"export {name}", f"{name}: ", reason) for name, (_, reason) in INSTANCES.items()),
    *((f"{command} cut{suffix}", f"cut{suffix}: ", "")
      for command in ("run", "export", "draw -o out.png") for suffix in (".json", ".npz")),
    *((f"run {sketch} --size {size}", "", f"size is {size}; choose")
      for sketch in ("mouse", "wave_sheet", "sketch.png") for size in (0, -1, 10**6)),
    ("run half.png", "half.png: is not a whole picture", ""),
    ("run blank.png", "blank.png: shows no stroke", ""),
    ("run sketch.png --mask small.png", "small.png: ", "50 x 40.* 60 x 40"),
    ("run sketch.png --mask off.png", "", "no stroke lies inside the mask"),
    ("run sketch.png --mask black.png", "", "black all over"),
    ("run mouse --mask black.png", "", "leave --mask out"),
    ("run tiny.json --size 30", "", "leave --size and --mask out"),
    ("run missing.svg", "", "crossfield list"),
    ("run .", "", "is a directory"),
    ("draw field.npz -o out.png", "", "no such file"),
    ("export tiny.json -f milp-mccormick -f milp-mcormick", "", re.escape(NO_SUCH_FORMULATION)),
    ("export tiny.json -F nl -F xyz", "", "there is no format 'xyz'; choose one of nl, gms, lp, mps"),
    ("solve tiny.json -f quartc", "", r"there is no formulation 'quartc' \(is it quartic\?\)"),
    ("solve tiny.json -f milp-mccormick --solver gurobo", "",
     "there is no solver 'gurobo'; choose one of gurobi, cplex, xpress, highs, scip"),
    ("solve tiny.json -f minlp-cubic", "",
     r"is a non-convex MINLP, which is not for highs \(HiGHS reads an MIQP, but does not solve it\)"),
    ("solve tiny.json -f milp-mccormick --solver ipopt", "",
     r"not for ipopt \(Ipopt drops integrality; relax it, or fix the jumps\)"),
    ("solve tiny.json -f qp-fixed --relax", "", "qp-fixed has no option relax"),
    ("solve tiny.json -f qp-fixed --start other.npz", "other.npz: the field is on another instance", ""),
    ("export tiny.json --start other.npz", "other.npz: the field is on another instance", ""),
    ("instance mouse -o out.txt", "out.txt: ", ".json, .npz"),
    ("instance mouse -o out", "out: ", ".json, .npz"),
    ("draw tiny.json -o out.bmp", "out.bmp: ", ".png, .svg, .pdf"),
    ("draw tiny.txt -o out.png", "tiny.txt: ", ".npz, .json"),
    ("read tiny.sol --manifest tiny.json -o out.png", "out.png: ", ".npz, .json, .rawfield"),
    ("draw tiny.json --kind crosses -o out.png", "", "without a field"),
    ("draw tiny.json --kind art -o out.png", "", "there is no kind of picture 'art'"),
]  # fmt: skip
"""Command line, with `-o out` unless it has another, begin of the error and a pattern of the rest."""


@for_each("arguments, begin, reason", REFUSED)
def test_bad_input_is_refused(files, refused, arguments, begin, reason):
    command = arguments if " -o " in arguments else f"{arguments} -o out"
    line = refused(*command.split())
    assert line.startswith(begin)
    assert re.search(reason, line)


def test_a_refused_format_is_reported_and_recorded(files, capsys):
    assert invoke(["export", "tiny.json", "-f", "minlp-parity", "-F", "lp", "-F", "nl", "-o", "out"]) == 0
    assert "write minlp-quartic, which is the same problem" in capsys.readouterr().out
    document = cf.read_manifest("out/tiny.minlp-parity.manifest.json").document
    assert document["refused"].keys() == {"lp"}
    assert not list(Path("out").glob("*.lp"))


# Solutions


@pytest.mark.parametrize(
    "words, status, claim",
    [("Infeasible", "unknown", "infeasible"), ("Time limit reached", "no-point", "limit-without-point")],
)
def test_solutions_without_a_point_are_refused(files, refused, instance, words, status, claim):
    """The others: tests/export/solutions. HiGHS lists no names then, so nothing states the problem."""
    exported = cf.write_problem(cf.formulate(instance, "milp-mccormick"), "set", formats=["nl"])
    Path("none.sol").write_text(WITHOUT_POINT.format(words))
    line = refused("read", "none.sol", "--manifest", exported.path, "-o", "field.npz")
    assert line.startswith(f"none.sol: holds no point: {status}; {words}; claims not kept ({claim})")


WITHOUT_POINT = "Model status\n{}\n\n# Primal solution values\nNone\n\n# Dual solution values\nNone\n"


# The machine: missing solvers, folders that cannot be written, full disks


def in_child(*arguments, prelude=""):
    """Run a command line in a child process, after some lines of Python."""
    code = (
        f"import sys\n{prelude}\nfrom crossfield.export.cli.app import invoke\nsys.exit(invoke(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_another_solver_for_the_class_replaces_a_missing_one(files):
    arguments = ["solve", "tiny.json", "-f", "milp-mccormick", "--json", "-o", "out"]
    done = in_child(*arguments, prelude="sys.modules['highspy'] = None")
    assert done.returncode == 0
    assert json.loads(done.stdout)["message"].startswith("bonmin")


@pytest.mark.slow
def test_a_run_without_solvers_still_computes_a_field(tmp_path, files, instance):
    prelude = "sys.modules['highspy'] = sys.modules['casadi'] = None"
    arguments = ["run", "tiny.json", "--time-limit", "1", "--threads", "1", "-o", "out", "--json"]
    done = in_child(*arguments, prelude=prelude)
    assert done.returncode == 0
    report = json.loads(done.stdout)
    assert report == json.loads((tmp_path / "out" / "report.json").read_text())
    assert {row["method"] for row in report["methods"]} == {
        "start", "greedy", "power", "power + QP", "polyvector", "polyvector + QP", "bend",
        "search", "prove",
    }  # fmt: skip
    assert set(report["failures"]) == {"two-stage"}
    assert all("is not installed" in reason for reason in report["failures"].values())
    assert cf.read_field(tmp_path / "out" / "field.npz").instance.sha256 == instance.sha256


@pytest.mark.slow
@pytest.mark.parametrize("where", ["file", "proc"])
def test_folders_that_cannot_be_made_are_refused(tmp_path, refused, instance, where):
    cf.write_instance(instance, tmp_path / "tiny.json")
    cf.write_field(cf.greedy_field(instance), tmp_path / "field.npz")
    (tmp_path / "regular").write_text("a file")
    if where == "proc" and not Path("/proc/sys").is_dir():
        pytest.skip("there is no /proc")
    folder = tmp_path / "regular" if where == "file" else Path("/proc/sys")
    for command in ("run", "export"):
        assert refused(command, tmp_path / "tiny.json", "-o", folder / "out").startswith(
            f"{folder / 'out'}: cannot be created"
        )
    line = refused("solve", tmp_path / "tiny.json", "-f", "milp-mccormick", "-o", folder / "out")
    assert line.startswith(f"{folder / 'out'}: cannot be created")
    for arguments in (
        ("instance", "skew", "-o", folder / "o.json"),
        ("draw", tmp_path / "field.npz", "-o", folder / "o.png"),
    ):
        line = refused(*arguments)
        assert line.startswith((f"{arguments[-1]}: cannot be written", f"{folder}: is no folder"))
        assert "choose another folder" in line


FULL = """import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({0}, {0}))"""
DISK = {
    "instance": (["instance", "mouse"], "out.json", 1000),
    "export": (["export", "mouse", "--size", "10", "-f", "milp-mccormick"], "out", 30_000),
    "run": (["run", "mouse", "--size", "10"], "out", 30_000),
    "draw": (["draw", "field.npz"], "out.png", 1000),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", DISK)
def test_only_complete_files_remain_on_a_full_disk(tmp_path, monkeypatch, case):
    arguments, output, limit = DISK[case]
    monkeypatch.chdir(tmp_path)
    cf.write_field(cf.greedy_field(cf.sample("mouse", 8)), "field.npz")
    done = in_child(*arguments, "-o", output, prelude=FULL.format(limit))
    assert (done.returncode, PLAN.sub("", done.stdout)) == (1, "")
    assert complaints(done.stderr).count("\n") == 1
    assert "cannot be written: file too large; free some space" in done.stderr
    left = [path for path in tmp_path.rglob("*") if path.is_file() and path.name not in {"field.npz", LIST}]
    assert all(path.stat().st_size < limit for path in left)
    assert not [path for path in left if path.suffix == ".part"]
    if not Path(output).is_dir():
        assert left == []
    for path in left:  # the files are complete: instances, or model files
        if path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".nl":
            assert path.read_bytes().count(b"\n") > 100
    assert not (tmp_path / "out" / "report.json").exists()


@pytest.mark.slow
def test_an_existing_file_survives_a_full_disk(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cf.write_instance(cf.sample("skew", 8), "out.json")
    before = Path("out.json").read_bytes()
    done = in_child("instance", "mouse", "-o", "out.json", prelude=FULL.format(1000))
    assert done.returncode == 1
    assert Path("out.json").read_bytes() == before
    assert {path.name for path in tmp_path.iterdir()} == {"out.json", LIST}


@pytest.mark.slow
def test_a_full_device_is_reported(tmp_path):
    if not Path("/dev/full").exists():
        pytest.skip("there is no /dev/full")
    with Path("/dev/full").open("wb") as full:
        command = [sys.executable, "-m", "crossfield", "list", "--json"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert "no space left on device" in done.stderr
    assert done.stderr.count("\n") == 1
