"""Bad input on the command line: exit code 1, one line that names file and reason, and no new files."""

import json
import re
import subprocess
import sys
from pathlib import Path

import crossfield as cf
import pytest
from cases import make_instance
from children import complaints
from command_line import invoke
from folders import LIST
from loops import for_each
from meshes import box, write_obj
from moves import turned
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
    return make_instance("row")


def picture(paper, boxes=(), lines=(), size=(60, 40)):
    image = Image.new("L", size, paper)
    for box_of_mask in boxes:
        ImageDraw.Draw(image).rectangle(box_of_mask, fill=255)
    for line in lines:
        ImageDraw.Draw(image).line(line, fill=0, width=3)
    return image


PICTURES = {
    "sketch.png": picture(255, lines=[(5, 5, 55, 35), (5, 35, 55, 5)]),
    "blank.png": picture(255),
    "small.png": picture(0, [(0, 0, 9, 9)], size=(50, 40)),
    "off.png": picture(0, [(27, 0, 33, 4)]),
    "black.png": picture(0),
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
    cf.write_field(cf.greedy_field(instance), "field.npz")
    cf.write_field(cf.greedy_field(instance), "theirs.rawfield")
    cf.write_instance(instance.with_weights(stroke_weight=10), "heavy.json")
    write_obj(Path("cube.obj"), box())


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
    ("run tiny.json --size 30", "", "is no drawing; leave --size out"),
    ("run missing.svg", "", "crossfield list"),
    ("run .", "", "is a directory"),
    ("draw none.npz -o out.png", "", "no such file"),
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
    ("draw tiny.json -o out.bmp", "out.bmp: ", ".png, .svg"),
    ("draw tiny.txt -o out.png", "tiny.txt: ", ".npz, .json"),
    ("read tiny.sol --manifest tiny.json -o out.png", "out.png: ", ".npz, .json, .rawfield"),
    ("draw theirs.rawfield -o out.png", "", "holds no instance; give its instance with --on"),
    ("draw other.npz --on tiny.json -o out.png", "", "the field is on another instance"),
    ("solve heavy.json -m search --start field.npz", "", "stroke weight 10.*size, gauge and weights"),
    ("instance mouse --sharp 35 -o x.json", "mouse: is no mesh file; leave --sharp out", ""),
    ("instance tiny.json --weights dual -o x.json", "tiny.json: is no mesh file", ""),
    ("instance cube.obj --size 9 -o x.json", "cube.obj: is a mesh; leave --size out", ""),
    ("instance cube.obj --view top -o x.json", "cube.obj: is a mesh; leave --view out", ""),
    ("instance none.obj -o x.json", "none.obj: cannot be read: no such file", ""),
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


# Solutions


WITHOUT_POINT = "Model status\nInfeasible\n\n# Primal solution values\nNone\n\n# Dual solution values\nNone\n"


def test_solutions_without_a_point_are_refused(files, refused, instance):
    """The others: tests/export/solutions. HiGHS lists no names then, so nothing states the problem."""
    exported = cf.write(cf.formulate(instance, "milp-mccormick"), "set", formats=["nl"])
    Path("none.sol").write_text(WITHOUT_POINT)
    line = refused("read", "none.sol", "--manifest", exported.path, "-o", "field.npz")
    assert line.startswith("none.sol: holds no point: unknown; Infeasible; claims not kept (infeasible)")


# The machine: missing solvers, folders that cannot be written, full disks


def in_child(*arguments, prelude=""):
    """Run a command line in a child process, after some lines of Python."""
    code = f"import runpy, sys\n{prelude}\nrunpy.run_module('crossfield', run_name='__main__')"
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_a_run_without_solvers_still_computes_a_field(tmp_path, files, instance):
    prelude = "sys.modules['highspy'] = sys.modules['casadi'] = None"
    arguments = ["run", "tiny.json", "--time-limit", "1", "--threads", "1", "-o", "out", "--json"]
    done = in_child(*arguments, prelude=prelude)
    assert done.returncode == 0
    report = json.loads(done.stdout)
    assert report == json.loads((tmp_path / "out" / "report.json").read_text())
    assert {row["method"] for row in report["methods"]} - {"prove"} == {  # for which the time may not suffice
        "start", "greedy", "power", "power + QP", "polyvector", "polyvector + QP", "bend", "search",
    }  # fmt: skip
    reasons = {"two-stage": "is not installed", "certificate": "nothing was proven"}  # likewise
    assert all(reasons[name] in report["failures"][name] for name in {"two-stage", *report["failures"]})
    assert cf.read_field(tmp_path / "out" / "field.npz").instance.sha256 == instance.sha256


@pytest.mark.parametrize("folder", ["regular", "/proc/sys"])
def test_folders_that_cannot_be_made_are_refused(files, refused, folder):
    Path("regular").write_text("a file")
    if not Path(folder).exists():
        pytest.skip("there is no /proc")
    for command in ("run tiny.json", "export tiny.json", "solve tiny.json -f milp-mccormick"):
        line = refused(*command.split(), "-o", f"{folder}/out")
        assert line.startswith(f"{folder}/out: cannot be created")
    for command in ("instance skew -o {}/o.json", "draw field.npz -o {}/o.png"):
        line = refused(*command.format(folder).split())
        assert line.startswith(folder)
        assert "choose another folder" in line


FULL = """import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({0}, {0}))"""
DISK = {
    "instance mouse -o out.json": 1000,
    "export mouse --size 10 -f milp-mccormick -o out": 30_000,
    "run mouse --size 10 --time-limit 0.5 -o out": 30_000,
}


@pytest.mark.slow
@pytest.mark.parametrize("command", DISK)
def test_only_complete_files_and_earlier_ones_remain_on_a_full_disk(tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    limit, earlier = DISK[command], cf.write_instance(cf.sample("skew", 8), "out.json")
    before = earlier.read_bytes()
    done = in_child(*command.split(), prelude=FULL.format(limit))
    assert (done.returncode, PLAN.sub("", done.stdout)) == (1, "")
    assert complaints(done.stderr).count("\n") == 1
    assert "cannot be written: file too large; free some space" in done.stderr
    assert earlier.read_bytes() == before
    left = [path for path in tmp_path.rglob("*") if path.is_file() and path.name not in {"out.json", LIST}]
    assert all(path.stat().st_size < limit for path in left)
    assert not [path for path in left if path.suffix == ".part" or path.name == "report.json"]
    for path in left:  # the files are complete: instances, or model files
        if path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".nl":
            assert path.read_bytes().count(b"\n") > 100


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
