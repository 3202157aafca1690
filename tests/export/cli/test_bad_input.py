"""Bad input on the command line: exit code 1, one line that names file and reason, and no new files."""

import json
import math
import re
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import crossfield as cf
import numpy as np
import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.export.formats.nl import Layout
from crossfield.export.solutions.readers.ampl import write_ampl_sol
from crossfield.models.memory import available_memory
from loops import for_each
from PIL import Image, ImageDraw

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 60 40">{}</svg>'
STROKES = '<path d="M5 5 L55 35 M5 35 L55 5" stroke="black"/>'


def listing(folder):
    return {path: path.stat().st_size for path in sorted(folder.rglob("*"))}


PLAN = re.compile(r"\Aat most .+ s: .+; files and pictures on top\n\Z")
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
    return cf.Instance("tiny", mask, np.array([[0, 0], [1, 1]]), np.array([0.3, 1.2]), np.array([1.0, 0.5]))


@pytest.fixture
def exported(tmp_path, instance):
    """A folder with the instance, `milp-mccormick` in .nl and .mps, its manifest; the instance elsewhere."""
    cf.write_problem(cf.formulate(instance, "milp-mccormick"), tmp_path / "set", formats=["nl", "mps"])
    return tmp_path / "set"


@pytest.fixture
def manifest(exported):
    return exported / "tiny.milp-mccormick.manifest.json"


def picture(path, *, size=(60, 40), paper=255, lines=True):
    image = Image.new("L", size, paper)
    if lines:
        pen = ImageDraw.Draw(image)
        pen.line((5, 5, 55, 35), fill=0, width=3)
        pen.line((5, 35, 55, 5), fill=0, width=3)
    image.save(path)
    return path


def mask_picture(path, *boxes, size=(60, 40)):
    image = Image.new("L", size, 0)
    for box in boxes:
        ImageDraw.Draw(image).rectangle(box, fill=255)
    image.save(path)
    return path


def png_header(width, height):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(bytes(1000)))
        + chunk(b"IEND", b"")
    )


def entity_bomb():
    doubled = "".join(f'<!ENTITY e{k} "&e{k - 1};&e{k - 1};">' for k in range(1, 40))
    return with_entities(f'<!ENTITY e0 "ha">{doubled}', "e39")


def with_entities(declared: str, used: str) -> str:
    drawing = SVG.format(f"<text>&{used};</text>" + STROKES)
    return f'<?xml version="1.0"?><!DOCTYPE svg [{declared}]>{drawing}'


EXTERNAL = with_entities('<!ENTITY e SYSTEM "file:///etc/hostname">', "e")
SKETCHES = {
    "empty.png": (b"", "empty"),
    "words.png": (b"these are words", "not a whole picture"),
    "huge.png": (png_header(60_000, 60_000), "pixels; scale it down"),
    "large.png": (png_header(12_000, 12_000), "pixels; "),
    "bare.svg": (SVG.format("").encode(), "no stroke"),
    "invisible.svg": (SVG.format(STROKES.replace('stroke="black"', 'fill="none"')).encode(), "no stroke"),
    "bomb.svg": (entity_bomb().encode(), "entities"),
    "external.svg": (EXTERNAL.encode(), "entities"),
    "cut.svg": (SVG.format(STROKES).encode()[:90], "not well-formed XML"),
    "page.svg": (b"<html><body/></html>", "<html>"),
    "empty.svg": (b"", "empty"),
    "broken.scap": (b"#60\t40\n@1\n{\n#1\t1\n", ""),
}


@for_each("name", SKETCHES)
@for_each("command", ["run", "instance"])
def test_bad_sketches_are_refused(tmp_path, refused, name, command):
    content, reason = SKETCHES[name]
    (tmp_path / name).write_bytes(content)
    output = tmp_path / ("out" if command == "run" else "out.json")
    line = refused(command, tmp_path / name, "-o", output)
    assert line.startswith(f"{tmp_path / name}: ")
    assert reason in line


def test_a_truncated_picture_is_refused(tmp_path, refused):
    whole = picture(tmp_path / "sketch.png").read_bytes()
    (tmp_path / "sketch.png").write_bytes(whole[: len(whole) // 2])
    assert "sketch.png: is not a whole picture" in refused(
        "run", tmp_path / "sketch.png", "-o", tmp_path / "out"
    )


def test_blank_paper_is_refused(tmp_path, refused):
    picture(tmp_path / "blank.png", lines=False)
    assert "blank.png: shows no stroke" in refused("run", tmp_path / "blank.png", "-o", tmp_path / "out")


def test_a_mask_of_another_size_is_refused(tmp_path, refused):
    picture(tmp_path / "sketch.png")
    mask = mask_picture(tmp_path / "mask.png", (0, 0, 9, 9), size=(50, 40))
    line = refused("run", tmp_path / "sketch.png", "--mask", mask, "-o", tmp_path / "out")
    assert line.startswith(f"{mask}: ")
    assert "50 x 40" in line
    assert "60 x 40" in line


def test_a_mask_without_a_stroke_is_refused(tmp_path, refused):
    picture(tmp_path / "sketch.png")
    mask = mask_picture(tmp_path / "mask.png", (27, 0, 33, 4))
    assert "no stroke lies inside the mask" in refused(
        "run", tmp_path / "sketch.png", "--mask", mask, "-o", tmp_path / "out"
    )


def test_a_black_mask_and_a_mask_for_a_sample_are_refused(tmp_path, refused):
    picture(tmp_path / "sketch.png")
    black = mask_picture(tmp_path / "mask.png")
    assert "black all over" in refused(
        "run", tmp_path / "sketch.png", "--mask", black, "-o", tmp_path / "out"
    )
    assert "leave --mask out" in refused("run", "mouse", "--mask", black, "-o", tmp_path / "out")


def test_a_mask_of_several_parts_is_allowed(tmp_path, capsys):
    picture(tmp_path / "sketch.png")
    mask = mask_picture(tmp_path / "mask.png", (0, 0, 20, 39), (40, 0, 59, 39))
    arguments = [
        "instance",
        tmp_path / "sketch.png",
        "--mask",
        mask,
        "--size",
        12,
        "-o",
        tmp_path / "two.json",
    ]
    assert invoke([str(argument) for argument in arguments]) == 0
    out, err = capsys.readouterr()
    assert "pixels in 2 separate parts" in out
    assert err == ""
    assert cf.read_instance(tmp_path / "two.json").grid.parts == 2


@for_each("what", ["mouse", "wave_sheet", "sketch.png"])
@for_each("size", [0, -1, 10**6])
def test_impossible_sizes_are_refused(tmp_path, refused, monkeypatch, what, size):
    picture(tmp_path / "sketch.png")
    monkeypatch.chdir(tmp_path)
    assert f"size is {size}; choose" in refused("run", what, "--size", size, "-o", "out")


def test_a_size_beyond_the_memory_is_estimated_and_refused(tmp_path, refused):
    if (available_memory() or math.inf) > 60e9:
        pytest.skip("this machine has memory enough for the largest grid, or does not state what it has")
    line = refused("export", "mouse", "--size", 4096, "-o", tmp_path / "out")
    assert "GB" in line
    assert "choose a smaller size" in line


def instance_document(instance, tmp_path):
    cf.write_instance(instance, tmp_path / "instance.json")
    return json.loads((tmp_path / "instance.json").read_text())


@for_each(
    "change,reason",
    [
        (lambda d: d["strokes"][0].__setitem__(2, float("nan")), "theta is not a finite number"),
        (lambda d: d["strokes"][0].__setitem__(3, 2.0), "maximum of 1"),
        (lambda d: d["strokes"][0].__setitem__(0, 99), "outside the mask"),
        (lambda d: d.__setitem__("version", 2), "version 2"),
        (lambda d: d.__setitem__("format", "other"), "format"),
        (lambda d: d.pop("mask"), "mask"),
        (lambda d: d.__setitem__("w_beta", "much"), "w_beta"),
        (lambda d: d["mask"].append("#"), "mask row 2"),
    ],
)
def test_bad_instances_are_refused(tmp_path, refused, instance, change, reason):
    document = instance_document(instance, tmp_path)
    change(document)
    (tmp_path / "bad.json").write_text(json.dumps(document))
    line = refused("export", tmp_path / "bad.json", "-o", tmp_path / "out")
    assert line.startswith(f"{tmp_path / 'bad.json'}: ")
    assert reason in line


@pytest.mark.parametrize("suffix", [".json", ".npz"])
def test_truncated_instances_are_refused(tmp_path, refused, instance, suffix):
    path = tmp_path / f"instance{suffix}"
    cf.write_instance(instance, path)
    path.write_bytes(path.read_bytes()[:-40])
    for command in ("run", "export"):
        assert refused(command, path, "-o", tmp_path / "out").startswith(f"{path}: ")
    assert refused("draw", path, "-o", tmp_path / "out.png").startswith(f"{path}: ")


def test_an_instance_has_its_own_grid(tmp_path, refused, instance):
    cf.write_instance(instance, tmp_path / "instance.json")
    assert "leave --size and --mask out" in refused(
        "run", tmp_path / "instance.json", "--size", 30, "-o", tmp_path / "out"
    )


def test_missing_files_are_refused_with_a_hint(tmp_path, refused):
    assert "crossfield samples" in refused("run", tmp_path / "missing.svg", "-o", tmp_path / "out")
    assert "is not a file" in refused("run", tmp_path, "-o", tmp_path / "out")
    assert "no such file" in refused("draw", tmp_path / "field.npz", "-o", tmp_path / "out.png")


NAMES = {
    "formulation": (
        ["export", "-f", "milp-mccormick", "-f", "milp-mcormick"],
        "there is no formulation 'milp-mcormick' (is it milp-mccormick?); choose one of minlp-parity, ",
    ),
    "format": (
        ["export", "-F", "nl", "-F", "xyz"],
        "there is no format 'xyz'; choose one of nl, gms, lp, mps",
    ),
    "formulation to solve": (["solve", "-f", "quartc"], "there is no formulation 'quartc' (is it quartic?)"),
    "solver": (
        ["solve", "-f", "milp-mccormick", "--solver", "gurobo"],
        "there is no solver 'gurobo'; choose one of gurobi, cplex, xpress, highs, scip",
    ),
    "class": (
        ["solve", "-f", "minlp-cubic"],
        (
            "minlp-cubic is a non-convex MINLP, which is not for highs "
            "(HiGHS reads an MIQP, but does not solve it)"
        ),
    ),
    "pair": (
        ["solve", "-f", "milp-mccormick", "--solver", "ipopt"],
        "not for ipopt (Ipopt drops integrality; relax it, or fix the jumps)",
    ),
    "option": (["solve", "-f", "qp-fixed", "--relax"], "qp-fixed has no option relax"),
}  # fmt: skip


@pytest.mark.parametrize("case", NAMES)
def test_unknown_names_are_refused_before_a_byte_is_written(tmp_path, refused, instance, case):
    (command, *options), reason = NAMES[case]
    cf.write_instance(instance, tmp_path / "tiny.json")
    assert reason in refused(command, tmp_path / "tiny.json", *options, "-o", tmp_path / "out")


def test_a_refused_format_is_reported_and_recorded(tmp_path, instance, capsys):
    cf.write_instance(instance, tmp_path / "tiny.json")
    out = tmp_path / "out"
    assert (
        invoke(["export", str(tmp_path / "tiny.json"), "-f", "minlp-parity", "-F", "lp", "-o", str(out)]) == 0
    )
    assert "write minlp-quartic, which is the same problem" in capsys.readouterr().out
    assert cf.read_manifest(out / "tiny.minlp-parity.manifest.json").document["refused"].keys() == {"lp"}
    assert not list(out.glob("*.lp"))


SUFFIXES = {
    "instance": (["instance", "mouse"], "out.txt", ".json, .npz"),
    "no suffix": (["instance", "mouse"], "out", ".json, .npz"),
    "picture": (["draw", "tiny.json"], "out.bmp", ".png, .svg, .pdf"),
    "subject": (["draw", "tiny.txt"], "out.png", ".npz, .json"),
    "field": (["read", "tiny.sol", "--manifest", "tiny.json"], "out.png", ".npz, .json, .rawfield"),
}


@pytest.mark.parametrize("case", SUFFIXES)
def test_unknown_suffixes_are_refused(tmp_path, refused, instance, monkeypatch, case):
    arguments, output, allowed = SUFFIXES[case]
    cf.write_instance(instance, tmp_path / "tiny.json")
    (tmp_path / "tiny.txt").write_text("text")
    monkeypatch.chdir(tmp_path)
    line = refused(*arguments, "-o", output)
    assert allowed in line
    assert line.startswith("tiny.txt: " if case == "subject" else f"{output}: ")


def test_an_instance_has_no_crosses_to_draw(tmp_path, refused, instance):
    cf.write_instance(instance, tmp_path / "tiny.json")
    line = refused("draw", tmp_path / "tiny.json", "--kind", "crosses", "-o", tmp_path / "out.png")
    assert "without a field" in line
    assert "there is no kind of picture 'art'" in refused(
        "draw", tmp_path / "tiny.json", "--kind", "art", "-o", tmp_path / "out.png"
    )


def test_a_start_on_another_instance_is_refused(tmp_path, refused, instance):
    cf.write_instance(instance, tmp_path / "tiny.json")
    cf.write_field(cf.greedy_field(instance.turned()), tmp_path / "other.npz")
    for command in (
        ["solve", tmp_path / "tiny.json", "-f", "milp-mccormick"],
        ["export", tmp_path / "tiny.json"],
    ):
        line = refused(*command, "--start", tmp_path / "other.npz", "-o", tmp_path / "out")
        assert line.startswith(f"{tmp_path / 'other.npz'}: the field is on another instance")


# Solutions


@pytest.fixture
def good_solution(tmp_path, exported, manifest, instance):
    """Solution file that HiGHS wrote for the exported problem."""
    import highspy

    highs = highspy.Highs()
    highs.setOptionValue("output_flag", "false")
    highs.readModel(str(exported / "tiny.milp-mccormick.mps"))
    highs.run()
    highs.writeSolution(str(tmp_path / "good.sol"), 0)
    return tmp_path / "good.sol"


def read(solution, manifest, output):
    return "read", solution, "--manifest", manifest, "-o", output


def test_the_good_solution_is_read(tmp_path, good_solution, manifest, capsys):
    arguments = [str(argument) for argument in read(good_solution, manifest, tmp_path / "field.npz")]
    assert invoke([*arguments, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["status"] == "optimal-global"
    assert facts["objective_recomputed"] == pytest.approx(facts["objective_reported"], abs=1e-9)
    assert facts["worst_violation"] < 1e-6
    assert cf.read_field(tmp_path / "field.npz").energy(1).total == pytest.approx(facts["energy_1_norm"])


def test_truncated_solutions_are_refused(tmp_path, refused, good_solution, manifest):
    text = good_solution.read_bytes()
    for length in np.linspace(0, text.index(b"# Rows") - 3, 8).astype(int):
        good_solution.write_bytes(text[:length])
        line = refused(*read(good_solution, manifest, tmp_path / "field.npz"))
        assert line.startswith(f"{good_solution}: ")


def test_truncated_sol_files_are_refused(tmp_path, refused, instance, manifest):
    problem = cf.formulate(instance, "milp-mccormick")
    whole = tmp_path / "whole.sol"
    point = problem.point(cf.greedy_field(instance))[Layout(problem).order]
    write_ampl_sol(whole, "solved", point, problem.n_rows, 0)
    content = whole.read_bytes()
    for length in np.linspace(1, content.index(b"objno") - 3, 12).astype(int):
        whole.write_bytes(content[:length])
        line = refused(*read(whole, manifest, tmp_path / "field.npz"))
        assert line.startswith(f"{whole}: ")
    whole.write_bytes(content)
    assert invoke([str(argument) for argument in (*read(whole, manifest, tmp_path / "field.npz"), "-q")]) == 0


def test_unknown_and_missing_names_in_a_solution_are_refused(tmp_path, refused, good_solution, manifest):
    text = good_solution.read_text()
    good_solution.write_text(text.replace("alpha_00_00 ", "omega_00_00 "))
    line = refused(*read(good_solution, manifest, tmp_path / "field.npz"))
    assert "1 of " in line
    assert "missing" in line
    assert "another instance, formulation or option" in line


def test_a_solution_of_another_instance_is_refused(tmp_path, refused, instance, good_solution, manifest):
    other = cf.sample("skew", 8)
    problem = cf.formulate(other, "milp-mccormick")
    write_ampl_sol(tmp_path / "other.sol", "solved", problem.point(cf.greedy_field(other)), problem.n_rows, 0)
    line = refused(*read(tmp_path / "other.sol", manifest, tmp_path / "field.npz"))
    assert line.startswith(f"{tmp_path / 'other.sol'}: ")
    cf.write_problem(problem, tmp_path / "skew", formats=["nl"])
    other_manifest = tmp_path / "skew" / "skew.milp-mccormick.manifest.json"
    assert "another instance" in refused(*read(good_solution, other_manifest, tmp_path / "field.npz"))


def test_a_manifest_next_to_another_instance_is_refused(
    tmp_path, refused, instance, exported, good_solution, manifest
):
    turned = instance.turned()
    cf.write_instance(turned, exported / "tiny.instance.json")
    line = refused(*read(good_solution, manifest, tmp_path / "field.npz"))
    assert line.startswith(f"{exported / 'tiny.instance.json'}: is another instance")
    (exported / "tiny.instance.json").unlink()
    assert "tiny.instance.json: cannot be read" in refused(
        *read(good_solution, manifest, tmp_path / "field.npz")
    )


def test_damaged_manifests_are_refused(tmp_path, refused, good_solution, manifest):
    document = json.loads(manifest.read_text())
    for key in ("instance", "formulation", "options", "columns", "jumps", "sha256", "files", "refused"):
        manifest.write_text(json.dumps({name: value for name, value in document.items() if name != key}))
        line = refused(*read(good_solution, manifest, tmp_path / "field.npz"))
        assert line.startswith(f"{manifest}: $: '{key}' is a required property")
    for change in (
        {"version": 7},
        {"version": True},
        {"formulation": "qp-fixed"},
        {"instance": {}},
        {"sha256": "0" * 64},
    ):
        manifest.write_text(json.dumps(document | change))
        assert refused(*read(good_solution, manifest, tmp_path / "field.npz")).startswith(f"{manifest}: ")
    document["instance"]["file"] = "../tiny.instance.json"
    manifest.write_text(json.dumps(document))
    assert "$.instance.file" in refused(*read(good_solution, manifest, tmp_path / "field.npz"))


WITHOUT_POINT = "Model status\n{}\n\n# Primal solution values\nNone\n\n# Dual solution values\nNone\n"


@pytest.mark.parametrize(
    "words,status", [("Infeasible", "infeasible"), ("Time limit reached", "limit-without-point")]
)
def test_solutions_without_a_point_are_refused(tmp_path, refused, manifest, words, status):
    (tmp_path / "none.sol").write_text(WITHOUT_POINT.format(words))
    line = refused(*read(tmp_path / "none.sol", manifest, tmp_path / "field.npz"))
    assert line.startswith(f"{tmp_path / 'none.sol'}: holds no point: {status}")


def test_an_infeasible_sol_file_is_refused(tmp_path, refused, instance, manifest):
    problem = cf.formulate(instance, "milp-mccormick")
    path = tmp_path / "none.sol"
    write_ampl_sol(path, "no solution", np.zeros(0), problem.n_rows, 220, columns=problem.n_columns)
    assert "holds no point: infeasible; no solution" in refused(*read(path, manifest, tmp_path / "field.npz"))


# The machine: missing solvers, folders that cannot be written, full disks


def in_child(*arguments, prelude=""):
    """Run a command line in a child process, after some lines of Python."""
    code = (
        f"import sys\n{prelude}\nfrom crossfield.export.cli.app import invoke\nsys.exit(invoke(sys.argv[1:]))"
    )
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "package,formulation", [("highspy", "milp-mccormick"), ("casadi", "qp-fixed"), ("casadi", "miqp-exact")]
)
@pytest.mark.slow
def test_a_missing_solver_is_named(tmp_path, instance, package, formulation):
    cf.write_instance(instance, tmp_path / "tiny.json")
    before = listing(tmp_path)
    solver = {"milp-mccormick": "highs", "qp-fixed": "ipopt", "miqp-exact": "bonmin"}[formulation]
    arguments = (
        "solve",
        tmp_path / "tiny.json",
        "-f",
        formulation,
        "--solver",
        solver,
        "-o",
        tmp_path / "out",
    )
    done = in_child(*arguments, prelude=f"sys.modules[{package!r}] = None")
    assert (done.returncode, done.stdout) == (1, "")
    title = {"highs": "HiGHS", "ipopt": "Ipopt", "bonmin": "Bonmin"}[solver]
    assert done.stderr == f"crossfield: {title} is not installed; pip install {package}\n"
    assert listing(tmp_path) == before


@pytest.mark.slow
def test_another_solver_for_the_class_replaces_a_missing_one(tmp_path, instance):
    cf.write_instance(instance, tmp_path / "tiny.json")
    arguments = ("solve", tmp_path / "tiny.json", "-f", "milp-mccormick", "--json", "-o", tmp_path / "out")
    done = in_child(*arguments, prelude="sys.modules['highspy'] = None")
    assert done.returncode == 0
    assert json.loads(done.stdout)["message"].startswith("bonmin")


@pytest.mark.slow
def test_a_run_without_solvers_still_computes_a_field(tmp_path, instance):
    cf.write_instance(instance, tmp_path / "tiny.json")
    prelude = "sys.modules['highspy'] = sys.modules['casadi'] = None"
    done = in_child(
        "run",
        tmp_path / "tiny.json",
        "--time-limit",
        1,
        "--threads",
        1,
        "-o",
        tmp_path / "out",
        "--json",
        prelude=prelude,
    )
    assert done.returncode == 0
    report = json.loads(done.stdout)
    assert report == json.loads((tmp_path / "out" / "report.json").read_text())
    assert {row["method"] for row in report["methods"]} == {
        "start",
        "greedy",
        "power",
        "power + QP",
        "polyvector",
        "polyvector + QP",
        "bend",
        "start + bend",
        "search",
        "prove",
    }
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
        assert line.startswith(f"{arguments[-1]}: cannot be written")
        assert "choose another folder" in line


FULL = """import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({0}, {0}))"""
DISK = {
    "instance": (["instance", "mouse"], "out.json", 1000),
    "export": (["export", "mouse", "--size", "10", "-f", "milp-mccormick"], "out", 30_000),
    "solve": (["solve", "mouse", "--size", "10", "-f", "milp-mccormick"], "out", 30_000),
    "run": (["run", "mouse", "--size", "10"], "out", 30_000),
    "draw": (["draw", "field.npz"], "out.png", 1000),
    "draw pdf": (["draw", "field.npz"], "out.pdf", 1000),
}


SLOW = ("solve", "run", "draw pdf", "draw", "export")


@pytest.mark.parametrize(
    "case", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in DISK]
)
def test_only_complete_files_remain_on_a_full_disk(tmp_path, monkeypatch, case):
    arguments, output, limit = DISK[case]
    monkeypatch.chdir(tmp_path)
    cf.write_field(cf.greedy_field(cf.sample("mouse", 8)), "field.npz")
    done = in_child(*arguments, "-o", output, prelude=FULL.format(limit))
    assert (done.returncode, PLAN.sub("", done.stdout)) == (1, "")
    assert complaints(done.stderr).count("\n") == 1
    assert "cannot be written: file too large; free some space" in done.stderr
    left = [path for path in tmp_path.rglob("*") if path.is_file() and path.name != "field.npz"]
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
    assert listing(tmp_path) == {tmp_path / "out.json": len(before)}


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
