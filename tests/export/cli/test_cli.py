"""The commands: exit codes, progress, tables, JSON, and identical bytes from repeated calls."""

import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import crossfield as cf
import pytest
from answers import HIGHS_STATES_BOUNDS
from cases import make_instance, write_point
from children import complaints as without_progress
from command_line import invoke
from crossfield.export.formats.registry import FORMATS
from crossfield.export.runs.methods import METHODS
from crossfield.export.solvers_table import BUNDLED, SOLVERS
from crossfield.models.formulations.catalogue import FORMULATIONS
from crossfield.models.sketch.samples import SAMPLES
from folders import contents
from loops import for_each


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
    return make_instance("row")


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
    assert again["status"] == ("optimal-global" if HIGHS_STATES_BOUNDS else "optimal-in-gap")
    again = json.loads(crossfield(f"{read} -o field.json --gap 1e-6 --json"))
    assert again["status"] == facts["status"] == "optimal-global"
    assert cf.read_field("field.json").energy(1).total == facts["energy_1_norm"]

    for picture, head in (("p.png", b"\x89PNG"), ("p.svg", b"<?xml")):
        crossfield(f"draw field.json -o {picture}")
        assert Path(picture).read_bytes().startswith(head)
    crossfield(f"{read} -o field.rawfield")
    crossfield("draw field.rawfield --on skew.json --kind crosses -o raw.png")
    crossfield("draw skew.json -o instance.png")
    crossfield("draw field.json --kind overview -o o.png")


def test_a_folder_with_the_name_of_a_sample_does_not_hide_it(crossfield):
    for _ in range(2):
        crossfield("export skew --size 6 -f qp-fixed -F nl -o skew")
    assert Path("skew/skew.qp-fixed.nl").exists()


def test_options_of_the_formulation_reach_the_files(crossfield, instance_file):
    crossfield("instance tiny.json --gauge box -o box.json")
    options = "--facet printed --stroke-norm 2 --relax"
    crossfield(f"export box.json -f milp-mccormick {options} --gzip -o out")
    document = json.loads(Path("out/tiny.milp-mccormick.manifest.json").read_text())
    assert document["options"] == {"facet": "printed", "stroke_norm": 2, "beta_norm": 1, "relax": True}
    assert document["instance"]["gauge"] == "box"
    names = [file["name"].removeprefix("tiny.milp-mccormick.") for file in document["files"]]
    assert sorted(names) == ["col", "gms.gz", "lp.gz", "mps.gz", "nl.gz", "row"]


def test_a_start_gives_the_jumps_of_qp_fixed(crossfield, instance, instance_file):
    power = cf.power_field(instance)
    cf.write_field(power, "power.npz")
    crossfield("export tiny.json -f qp-fixed --start power.npz -o files")
    problem = cf.read_manifest("files/tiny.qp-fixed.manifest.json").problem()
    assert problem.jumps.tolist() == power.p.tolist()
    facts = json.loads(crossfield("solve tiny.json -f qp-fixed --start power.npz -o s --json"))
    assert facts["energy_2_norm"] <= power.energy(2).total + 1e-9


# Usage, help, exit codes


USAGE = [
    "fly", "run mouse", "run mouse -o x --wings", "run mouse -o x --size large",
    "run mouse -o x --time-limit 0.09", "instance mouse -o x.json --gauge none", "solve mouse -o x",
    "export mouse -o x --stroke-norm 3", "export mouse -o x --stroke-norm 0", "read a.sol -o x.npz",
    "prove mouse", "prove -o x", "prove mouse --check it.npz", "prove mouse -o x --gap -1",
    "prove mouse -o x --norm 3",
    "run mouse -o x --threads -1", "solve mouse -m greedy -o x --threads 1000000",
    "library build a.toml -o x --jobs 0", "library verify x --jobs 1000000",
    # A method and a formulation exclude each other.
    "solve mouse -o x -m search -f qp-fixed", "solve mouse -o x -m search --relax",
    "solve mouse -o x -m greedy --solver highs", "solve mouse -o x -m prove",
]  # fmt: skip


@for_each("line", USAGE)
def test_wrong_usage_has_exit_code_2(line, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert invoke(line.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Usage: " in err
    assert list(tmp_path.iterdir()) == []


HEAVY = {
    "scipy", "sympy", "numba", "PIL", "casadi", "highspy", "pyomo", "jinja2", "distributed",
    "rich", "crossfield.models.proof", "crossfield.models.search", "crossfield.export.library",
    "crossfield.export.solving",
}  # fmt: skip


def modules_of(*arguments):
    """Names of the modules that a command has loaded at its end."""
    code = (
        "import atexit, runpy, sys; atexit.register(lambda: print(*sorted(sys.modules), file=sys.stderr))\n"
        "runpy.run_module('crossfield', run_name='__main__')"
    )
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return set(done.stderr.split())


def test_help_loads_nothing_heavy():
    assert not modules_of("--help") & (HEAVY - {"rich"} | {"numpy", "jsonschema"})


def test_files_are_written_and_read_without_solvers_proofs_and_libraries(crossfield, instance, instance_file):
    assert not modules_of("export", instance_file, "-f", "milp", "-F", "mps", "-o", "set") & HEAVY
    problem = cf.read_manifest("set/tiny.milp-mccormick.manifest.json").problem()
    write_point(Path("a.sol"), problem, problem.point(cf.greedy_field(instance)))
    manifest = "set/tiny.milp-mccormick.manifest.json"
    assert not modules_of("read", "a.sol", "--manifest", manifest, "-o", "field.npz") & HEAVY


@pytest.mark.slow
def test_commands_without_proofs_compile_nothing(crossfield, instance_file, tmp_path):
    code = (
        "import sys; from numba.core.event import install_recorder\n"
        "from crossfield.export.cli.app import invoke\n"
        "with install_recorder('numba:compile') as compiled:\n"
        "    codes = [invoke(line.split()) for line in sys.argv[1:]]\n"
        "print(codes, len(compiled.buffer), file=sys.stderr)"
    )
    lines = (
        "export tiny.json -f milp-mccormick -F mps -o set",
        "solve tiny.json -f milp-mccormick -o set",
        "read set/tiny.milp-mccormick.highs.sol --manifest set/tiny.milp-mccormick.manifest.json -o f.npz",
        "draw f.npz -o f.png",
        "library get cf_cyl_n005_milp -o got",
    )
    settings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", code, *lines], env=settings, capture_output=True, text=True, check=True
    )
    assert done.stderr.splitlines()[-1] == f"{[0] * len(lines)} 0"
    assert not (tmp_path / "cache").exists()  # nor do their child processes


def test_the_version_is_that_of_the_package(crossfield):
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


def test_an_internal_error_is_one_line_too(tmp_path, instance_file, monkeypatch, capsys):
    monkeypatch.setattr("crossfield.export.runs.methods.greedy_field", lambda *_, **__: 1 / 0)
    assert invoke(["solve", str(instance_file), "-m", "greedy", "-o", str(tmp_path / "out")]) == 1
    shown = capsys.readouterr()
    assert (shown.out, shown.err.count("\n")) == ("", 1)
    assert "internal error, please report it: ZeroDivisionError" in shown.err


# JSON, tables, progress


def test_only_json_is_printed_on_standard_output(crossfield, instance_file):
    exported = json.loads(crossfield("export tiny.json -f miqp-exact -o e --json"))
    assert exported == [json.loads(Path("e/tiny.miqp-exact.manifest.json").read_text())]
    solved = json.loads(crossfield("solve tiny.json -f miqp-exact -o e --json"))
    assert solved["status"] == "optimal-local"


def test_list_shows_all_tables(crossfield):
    listed = json.loads(crossfield("list --json"))
    assert [row["name"] for row in listed["formulations"]] == list(FORMULATIONS)
    assert [row["name"] for row in listed["formats"]] == list(FORMATS)
    assert all(set(SOLVERS) < set(row) for row in listed["solvers"])
    assert [row["name"] for row in listed["methods"]] == list(METHODS)
    text = crossfield("list")
    for word in " ".join(row["summary"] for row in listed["formulations"]).split():
        assert word in text.split()  # no word is broken
    for name in (*SAMPLES, *FORMULATIONS, *FORMATS, *BUNDLED, *(row["name"] for row in listed["readers"])):
        assert name in text


ON_TERMINAL = "import pty, sys; sys.exit(pty.spawn([sys.executable, '-m', 'crossfield', *sys.argv[1:]]) >> 8)"


@pytest.mark.slow
def test_progress_is_shown_on_a_terminal_only(tmp_path, instance_file):
    arguments = ["solve", str(instance_file), "-f", "qp-fixed", "-o", str(tmp_path / "t")]
    command = [sys.executable, "-c", ON_TERMINAL, *arguments]
    environment = os.environ | {"TERM": "xterm", "COLUMNS": "80", "LINES": "30"}
    done = subprocess.run(command, capture_output=True, check=True, env=environment, stdin=subprocess.DEVNULL)
    assert b"solving qp-fixed" in done.stdout
    assert b"\x1b[2K" in done.stdout  # lines that are wiped again
    done = child(*arguments)
    assert "solving" not in done.stdout
    assert without_progress(done.stderr) == ""


def test_an_export_of_which_nothing_can_be_written_is_an_error_with_the_remedy(tmp_path, capfd):
    command = ["export", "skew", "--size", "3", "-f", "parity", "-F", "mps", "-o", str(tmp_path / "out")]
    assert invoke(command) == 1
    assert "cannot carry minlp-parity; write minlp-quartic" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()
    assert invoke([*command, "-f", "milp", "-F", "nl"]) == 0
    assert "cannot carry minlp-parity; write minlp-quartic" in capfd.readouterr().out
    manifest = cf.read_manifest(tmp_path / "out" / "skew.minlp-parity.manifest.json")
    assert manifest.document["refused"].keys() == {"mps"}
