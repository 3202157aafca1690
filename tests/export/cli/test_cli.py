"""The commands: exit codes, progress, tables, JSON, and identical bytes from repeated calls."""

import io
import json
import os
import pty
import select
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import crossfield as cf
import numpy as np
import pytest
from cases import SKEWED
from children import complaints as without_progress
from crossfield.export.cli.app import invoke
from crossfield.export.formats.registry import FORMATS
from crossfield.export.runs.methods import METHODS
from crossfield.export.solvers_table import BUNDLED
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.sketch.samples import SAMPLES
from folders import contents
from loops import for_each
from PIL import Image, ImageDraw


@pytest.fixture
def crossfield(capsys, tmp_path, monkeypatch):
    """Function that runs a command line in the temporary folder without errors and returns its output."""
    monkeypatch.chdir(tmp_path)

    def run(line):
        code = invoke(line.split())
        out, err = capsys.readouterr()
        assert (code, without_progress(err)) == (0, "")
        return out

    return run


@pytest.fixture
def instance():
    mask = np.ones((2, 3), dtype=bool)
    pixels, theta = np.array([[0, 0], [0, 2], [1, 1]]), np.array([0.3, 2.0, 1.2])
    return cf.Instance.on_pixels("tiny", mask, pixels, theta, np.array([1.0, 0.7, 0.5]))


@pytest.fixture
def instance_file(tmp_path, instance):
    return cf.write_instance(instance, tmp_path / "tiny.json")


def child(*arguments, **options):
    command = [sys.executable, "-m", "crossfield", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


# The commands, one after the other


@pytest.mark.smoke
def test_each_command_reads_the_files_of_the_one_before(tmp_path, crossfield):
    """instance, export, solve, read, draw: each reads files of the previous command."""
    out = crossfield("instance skew --size 6 -o skew.json")
    instance = cf.read_instance("skew.json")
    assert f"{instance.grid.width} x {instance.grid.height}, {instance.grid.size} pixels" in out

    crossfield("export skew.json -f milp-mccormick -o files")
    stem = "skew.milp-mccormick"
    suffixes = (".nl", ".row", ".col", ".gms", ".lp", ".mps", ".manifest.json")
    names = set(contents(Path("files")))
    assert names == {"skew.instance.json", *(stem + suffix for suffix in suffixes)}

    facts = json.loads(crossfield("solve skew.json -f milp-mccormick --time-limit 5 --json -o solved"))
    assert facts["objective_recomputed"] == pytest.approx(facts["objective_reported"], rel=1e-9)

    read = f"read solved/{stem}.highs.sol --manifest files/{stem}.manifest.json"
    again = json.loads(crossfield(f"{read} -o field.json --json"))
    same = ("objective_recomputed", "objective_reported", "worst_violation", "energy_1_norm", "energy_2_norm")
    assert [again[key] for key in same] == [facts[key] for key in same]
    assert again["status"] == "optimal-in-gap"  # the file of HiGHS before 1.16 does not state its gap
    again = json.loads(crossfield(f"{read} -o field.json --gap 1e-6 --json"))
    assert again["status"] == facts["status"] == "optimal-global"
    assert cf.read_field("field.json").energy(1).total == facts["energy_1_norm"]

    for picture, head in (("p.png", b"\x89PNG"), ("p.svg", b"<?xml"), ("p.pdf", b"%PDF")):
        crossfield(f"draw field.json -o {picture}")
        assert Path(picture).read_bytes().startswith(head)
    crossfield("draw skew.json -o instance.png")
    crossfield("draw field.json --kind overview -o o.png")


RUN_FILES = {
    "index.html",
    "field.json", "field.npz", "field.obj", "field.rawfield", "field.sings", "lowest.npz", "report.json",
    "angle.png", "crosses.png", "field.png", "instance.png", "mask.png", "overview.png",
    "overlay.png", "overlay.svg",
}  # fmt: skip


@pytest.fixture(scope="module")
def two_parts(tmp_path_factory):
    """Folder of a run on a sketch whose mask has two parts, and its exit code, output and errors.

    On eight pixels and with a small weight the MILP is solved long before the time limit.
    """
    folder = tmp_path_factory.mktemp("run")
    sketch, mask = Image.new("L", (60, 40), 255), Image.new("L", (60, 40), 0)
    for line in ((5, 5, 55, 35), (5, 35, 55, 5), (8, 3, 8, 37)):
        ImageDraw.Draw(sketch).line(line, fill=0, width=3)
    for box in ((0, 0, 19, 19), (40, 20, 59, 39)):
        ImageDraw.Draw(mask).rectangle(box, fill=255)
    sketch.save(folder / "cross.png")
    mask.save(folder / "mask.png")
    options = ["--size", "6", "--stroke-weight", "0.2", "--time-limit", "10", "--threads", "1"]
    sketch = [str(folder / "cross.png"), "--mask", str(folder / "mask.png")]
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = invoke(["run", *sketch, *options, "-o", str(folder / "out")])
    return folder / "out", (code, out.getvalue(), err.getvalue())


def test_a_run_writes_all_files_and_reports_separate_parts(two_parts):
    folder, (code, out, err) = two_parts
    assert (code, without_progress(err)) == (0, "")
    assert "pixels in 2 separate parts" in out
    report = json.loads((folder / "report.json").read_text())
    assert report["instance"]["parts"] == 2
    proven = {"certificate.npz"} if report["proof"] else set()  # the time may not suffice on a busy machine
    shaded = {report["surface"]["picture"]} - {None}
    assert bool(shaded) == (not report["surface"]["doubts"])
    assert {name for name in contents(folder) if "/" not in name} == RUN_FILES | proven | shaded
    models = set(contents(folder / "models"))
    assert {name.split(".")[1] for name in models} == {"instance", *SKEWED}
    assert report["files"] == sum(Path(name).suffix[1:] in FORMATS for name in models)
    assert not [path for path in folder.rglob("*") if path.suffix == ".part"]


def test_a_run_keeps_the_bend_field_and_writes_the_minimum_energy_field(two_parts):
    folder, _ = two_parts
    report = json.loads((folder / "report.json").read_text())
    energies = [row["energy_2_norm"] for row in report["methods"]]
    lowest, kept = (cf.read_field(folder / name) for name in ("lowest.npz", "field.npz"))
    assert lowest.energy(2).total == pytest.approx(min(energies), rel=1e-9)
    assert energies == pytest.approx(sorted(energies), rel=1e-8)
    assert report["best"] == report["methods"][0]["method"]
    assert report["kept"] == "bend"
    of_kept = next(row for row in report["methods"] if row["method"] == "bend")
    assert kept.energy(2).total == pytest.approx(of_kept["energy_2_norm"], rel=1e-9)
    assert report["failures"] == {}
    for row in report["methods"]:
        if "status" in row:
            assert row["worst_violation"] < 1e-6
    by_method = {row["method"]: row for row in report["methods"]}
    assert by_method["start"]["energy_2_norm"] <= by_method["greedy"]["energy_2_norm"] + 1e-7
    assert by_method["search"]["energy_2_norm"] <= by_method["greedy"]["energy_2_norm"] + 1e-7
    assert by_method["power + QP"]["energy_2_norm"] <= by_method["power"]["energy_2_norm"] + 1e-7
    polyvector, best = by_method["polyvector"], by_method["polyvector + QP"]
    assert best["energy_2_norm"] <= polyvector["energy_2_norm"] + 1e-7
    assert by_method["MILP"]["energy_1_norm"] <= by_method["greedy"]["energy_1_norm"] + 1e-7
    fitted = by_method["two-stage"]  # at its limit Ipopt returns an intermediate point, which may be worse
    lower = fitted["energy_2_norm"] <= by_method["MILP"]["energy_2_norm"] + 1e-7
    assert lower or fitted["status"] == "limit-with-point"


def test_a_folder_with_the_name_of_a_sample_does_not_hide_it(crossfield):
    for _ in range(2):
        crossfield("export skew --size 6 -f qp-fixed -F nl -o skew")
    assert Path("skew/skew.qp-fixed.nl").exists()


def test_options_of_the_formulation_reach_the_files(crossfield, instance_file):
    crossfield("instance tiny.json --gauge box -o box.json")
    options = "--facet printed --stroke-norm 2 --relax --nl-form binary"
    crossfield(f"export box.json -f milp-mccormick {options} --gzip -o out")
    document = json.loads(Path("out/tiny.milp-mccormick.manifest.json").read_text())
    assert document["options"] == {"facet": "printed", "stroke_norm": 2, "beta_norm": 1, "relax": True}
    assert document["instance"]["gauge"] == "box"
    names = [file["name"].removeprefix("tiny.milp-mccormick.") for file in document["files"]]
    assert sorted(names) == ["col", "gms.gz", "lp.gz", "mps.gz", "nl.gz", "row"]
    assert {file["dialect"] for file in document["files"]} == {"binary", "scalar", ""}


def test_a_start_gives_the_jumps_of_qp_fixed(crossfield, instance, instance_file):
    power = cf.power_field(instance)
    cf.write_field(power, "power.npz")
    crossfield("export tiny.json -f qp-fixed --start power.npz -o files")
    problem = cf.read_manifest("files/tiny.qp-fixed.manifest.json").problem()
    assert problem.jumps.tolist() == power.p.tolist()
    facts = json.loads(crossfield("solve tiny.json -f qp-fixed --start power.npz -o s --json"))
    assert facts["energy_2_norm"] <= power.energy(2).total + 1e-9


@pytest.mark.slow
def test_a_search_without_a_point_removes_the_field_of_an_earlier_call(tmp_path, capsys):
    stale = tmp_path / "tiny.minlp-cubic.field.npz"
    mask = np.ones((1, 2), dtype=bool)
    instance = cf.Instance.on_pixels("tiny", mask, np.array([[0, 0]]), np.array([1.0]), np.array([1.0]))
    cf.write_field(cf.greedy_field(instance), stale)
    cf.write_instance(instance, tmp_path / "tiny.json")
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "casadi.py").write_text("raise ImportError('gone')")
    arguments = ["solve", tmp_path / "tiny.json", "-f", "minlp-cubic", "--relax", "-o", tmp_path]
    done = child(*arguments, env=os.environ | {"PYTHONPATH": str(broken)})
    assert done.returncode == 1
    assert "Ipopt: ImportError: gone" in done.stderr
    assert not (tmp_path / "tiny.minlp-cubic.ipopt.sol").exists()


# Usage, help, exit codes


@for_each(
    "arguments",
    [
        ["fly"],
        ["run", "mouse"],
        ["run", "mouse", "-o", "x", "--wings"],
        ["run", "mouse", "-o", "x", "--size", "large"],
        ["instance", "mouse", "-o", "x.json", "--gauge", "none"],
        ["run", "mouse", "-o", "x", "--time-limit", "0"],
        ["solve", "mouse", "-o", "x"],
        ["export", "mouse", "-o", "x", "--stroke-norm", "3"],
        ["read", "a.sol", "-o", "x.npz"],
        ["prove", "mouse"],
        ["prove", "-o", "somewhere"],
        ["prove", "mouse", "--check", "it.npz"],
        ["prove", "mouse", "-o", "somewhere", "--gap", "-1"],
        ["prove", "mouse", "-o", "somewhere", "--norm", "3"],
    ],
)
def test_wrong_usage_has_exit_code_2(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert invoke(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Usage: " in err
    assert list(tmp_path.iterdir()) == []


HEAVY = {
    "scipy", "sympy", "numba", "matplotlib", "PIL", "casadi", "highspy", "pyomo", "jinja2", "distributed",
    "rich", "crossfield.models.proof", "crossfield.models.search", "crossfield.export.library",
    "crossfield.export.solving",
}  # fmt: skip


def modules_of(*arguments):
    """Names of the modules that a command has loaded at its end."""
    code = (
        "import sys; from crossfield.export.cli.app import invoke; code = invoke(sys.argv[1:])\n"
        "print(*sorted(sys.modules), file=sys.stderr); sys.exit(code)"
    )
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return set(done.stderr.split())


def test_help_loads_nothing_heavy():
    assert not modules_of("--help") & (HEAVY - {"rich"} | {"numpy", "jsonschema"})


def test_files_are_written_and_read_without_solvers_proofs_and_libraries(crossfield, instance, instance_file):
    assert not modules_of("export", instance_file, "-f", "milp", "-F", "mps", "-o", "set") & HEAVY
    problem = cf.read_manifest("set/tiny.milp-mccormick.manifest.json").problem()
    columns = problem.to_arrays().column_names
    point = zip(columns, problem.point(cf.greedy_field(instance)), strict=True)
    Path("a.sol").write_text("".join(f"{name} {float(value)}\n" for name, value in point))
    manifest = "set/tiny.milp-mccormick.manifest.json"
    assert not modules_of("read", "a.sol", "--manifest", manifest, "-o", "field.npz") & HEAVY


def test_commands_without_proofs_compile_nothing(crossfield, instance_file, tmp_path):
    code = (
        "import sys; from numba.core.event import install_recorder\n"
        "from crossfield.export.cli.app import invoke\n"
        "with install_recorder('numba:compile') as compiled:\n"
        "    codes = [invoke(line.split()) for line in sys.argv[1:]]\n"
        "print(codes, len(compiled.buffer), file=sys.stderr)"
    )
    lines = (
        "export tiny.json -f milp-mccormick -F mps -o set -q",
        "solve tiny.json -f milp-mccormick -o set -q",
        "read set/tiny.milp-mccormick.highs.sol --manifest set/tiny.milp-mccormick.manifest.json -o f.npz -q",
        "draw f.npz -o f.png",
        "shade ring --size 12 -o shaded -q",
        "library get cf_cyl_n005_milp -o got -q",
    )
    settings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", code, *lines], env=settings, capture_output=True, text=True, check=True
    )
    assert done.stderr.splitlines()[-1] == f"{[0] * len(lines)} 0"
    assert not (tmp_path / "cache").exists()  # nor do their child processes


def test_the_version_is_that_of_the_package(crossfield):
    from importlib.metadata import version

    assert crossfield("--version") == f"crossfield {version('crossfield')}\n"


def test_debug_shows_the_traceback(tmp_path, capsys):
    (tmp_path / "bad.json").write_text("{}")
    arguments = ["run", str(tmp_path / "bad.json"), "-o", str(tmp_path / "out")]
    assert invoke(arguments) == 1
    assert capsys.readouterr().err.count("\n") == 1
    done = child("--debug", *arguments)
    assert done.returncode == 1
    assert "Traceback" in done.stderr
    assert "InstanceError" in done.stderr


def test_an_internal_error_is_one_line_too(tmp_path, instance_file):
    code = (
        "import sys, crossfield.models.search.greedy as g, crossfield.export.cli.app as c\n"
        "g.greedy_field = lambda *_, **__: 1 / 0\n"
        "sys.exit(c.invoke(sys.argv[1:]))"
    )
    arguments = ["solve", str(instance_file), "-f", "qp-fixed", "-o", str(tmp_path / "out")]
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.count("\n") == 1
    assert "internal error, please report it: ZeroDivisionError" in done.stderr


# Quiet, JSON, tables, progress


@pytest.mark.slow
def test_quiet_prints_nothing(crossfield, instance_file):
    solution, manifest = (f"set/tiny.milp-mccormick.{suffix}" for suffix in ("highs.sol", "manifest.json"))
    for line in (
        "export tiny.json -f milp-mccormick -o set",
        "solve tiny.json -f milp-mccormick -o set",
        f"read {solution} --manifest {manifest} -o f.npz",
        "run tiny.json --time-limit 1 --threads 1 -o run",
    ):
        assert crossfield(f"{line} -q") == ""


def test_only_json_is_printed_on_standard_output(crossfield, instance_file):
    exported = json.loads(crossfield("export tiny.json -f miqp-exact -o e --json"))
    assert exported == [json.loads(Path("e/tiny.miqp-exact.manifest.json").read_text())]
    solved = json.loads(crossfield("solve tiny.json -f miqp-exact -o e --json"))
    assert solved["status"] == "optimal-local"


def test_list_shows_all_tables(crossfield):
    listed = json.loads(crossfield("list --json"))
    assert [row["name"] for row in listed["formulations"]] == list(FORMULATIONS)
    assert [row["name"] for row in listed["formats"]] == list(FORMATS)
    assert all(set(BUNDLED) < set(row) for row in listed["solvers"])
    assert [row["name"] for row in listed["methods"]] == list(METHODS)
    text = crossfield("list")
    for name in (*SAMPLES, *FORMULATIONS, *FORMATS, *BUNDLED, *(row["name"] for row in listed["readers"])):
        assert name in text


def in_terminal(arguments, columns=80):
    """Exit code and output of a command line on a terminal."""
    leader, follower = pty.openpty()
    environment = os.environ | {"TERM": "xterm", "COLUMNS": str(columns), "LINES": "30"}
    command = [sys.executable, "-m", "crossfield", *map(str, arguments)]
    written = b""
    with subprocess.Popen(
        command, stdin=follower, stdout=follower, stderr=follower, env=environment
    ) as process:
        os.close(follower)
        while select.select([leader], [], [])[0]:
            try:
                piece = os.read(leader, 1 << 16)
            except OSError:  # the other end was closed
                break
            if not piece:
                break
            written += piece
        code = process.wait()
    os.close(leader)
    return code, written.decode()


@pytest.mark.slow
def test_progress_is_shown_on_a_terminal_only(tmp_path, instance_file):
    arguments = ("solve", instance_file, "-f", "qp-fixed", "-o", tmp_path / "t")
    code, shown = in_terminal(arguments)
    assert code == 0
    assert "solving qp-fixed" in shown
    assert "\x1b[2K" in shown  # lines that are wiped again
    code, shown = in_terminal([*arguments, "--quiet"])
    assert (code, shown) == (0, "")
    done = child(*arguments)
    assert "solving" not in done.stdout
    assert without_progress(done.stderr) == ""


@pytest.mark.parametrize("method", [name for name in METHODS if name != "prove"])
def test_every_method_writes_a_field_and_reports_its_energy(tmp_path, crossfield, instance_file, method):
    out = crossfield(f"solve tiny.json --method {method} --time-limit 0.5 --threads 1 --json -o .")
    facts = json.loads(out)
    (path,) = tmp_path.glob(f"*.{method}.field.npz")
    assert facts["energy_2_norm"] == pytest.approx(cf.read_field(path).energy().total, rel=1e-12)
    assert facts["interrupted"] is False


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("--method", "search", "-f", "qp-fixed"),
        ("--method", "search", "--relax"),
        ("--method", "greedy", "--solver", "highs"),
        ("--method", "prove"),
    ],
)
def test_a_method_and_a_formulation_exclude_each_other(tmp_path, instance_file, options, capsys):
    assert invoke(["solve", str(instance_file), *options, "-o", str(tmp_path / "out")]) == 2
    assert "method" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_an_export_of_which_nothing_can_be_written_is_an_error_with_the_remedy(tmp_path, capfd):
    command = ["export", "skew", "--size", "3", "-f", "parity", "-F", "mps", "-o", str(tmp_path / "out")]
    assert invoke(command) == 1
    assert "cannot carry minlp-parity; write minlp-quartic" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()
    assert invoke([*command, "-f", "milp"]) == 0
    assert "not written: mps holds nothing beyond quadratic and cannot carry minlp-parity" in (
        capfd.readouterr().out
    )
