"""What a run writes and reports: its files, the fields of all methods, what is proven, surface and page."""

import io
import json
import os
import re
import shlex
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import crossfield as cf
import pytest
from browsing import check_legibility, find, served, show
from cases import SKEWED, write_point
from children import complaints
from command_line import invoke, listed
from folders import contents
from meshes import box, write_obj
from PIL import Image, ImageDraw

FILES = {
    "index.html",
    "field.json", "field.npz", "field.obj", "field.rawfield", "field.sings", "lowest.npz", "report.json",
    "angle.png", "crosses.png", "field.png", "instance.png", "mask.png", "overview.png",
    "overlay.png", "overlay.svg",
}  # fmt: skip


@pytest.fixture(scope="module")
def two_parts(tmp_path_factory):
    """Folder of a run on a sketch whose mask has two parts, its exit code, output and errors, and its files.

    On eight pixels and with a small weight the MILP is solved long before the time limit.
    Tests may add files.
    """
    folder = tmp_path_factory.mktemp("run")
    sketch, mask = Image.new("L", (60, 40), 255), Image.new("L", (60, 40), 0)
    for line in ((5, 5, 55, 35), (5, 35, 55, 5), (8, 3, 8, 37)):
        ImageDraw.Draw(sketch).line(line, fill=0, width=3)
    for part in ((0, 0, 19, 19), (40, 20, 59, 39)):
        ImageDraw.Draw(mask).rectangle(part, fill=255)
    sketch.save(folder / "cross.png")
    mask.save(folder / "mask.png")
    options = ["--size", "6", "--stroke-weight", "0.2", "--time-limit", "10", "--threads", "1"]
    sketch = [str(folder / "cross.png"), "--mask", str(folder / "mask.png")]
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = invoke(["run", *sketch, *options, "-o", str(folder / "out")])
    return folder / "out", (code, out.getvalue(), err.getvalue()), contents(folder / "out")


@pytest.mark.slow
def test_a_run_writes_all_files_and_reports_separate_parts(two_parts):
    _, (code, out, err), written = two_parts
    assert (code, complaints(err)) == (0, "")
    assert "pixels in 2 separate parts" in out
    report = json.loads(written["report.json"])
    assert report["instance"]["parts"] == 2
    proven = {"certificate.npz"} if report["proof"] else set()  # the time may not suffice on a busy machine
    shaded = set() if report["surface"]["interrupted"] else {"shaded.png", "normals.png"}
    assert {name for name in written if "/" not in name} == FILES | proven | shaded
    assert report["surface"]["picture"] == ("shaded.png" if shaded else None)
    assert ("no shaded surface: " in out) == (not shaded)
    models = {name.removeprefix("models/") for name in written if name.startswith("models/")}
    assert {name.split(".")[1] for name in models} == {"instance", *SKEWED}
    formats = {row["name"] for row in listed()["formats"]}
    assert report["files"] == sum(Path(name).suffix[1:] in formats for name in models)


@pytest.mark.slow
def test_a_run_keeps_the_bend_field_and_writes_the_minimum_energy_field(two_parts):
    folder, _, written = two_parts
    report = json.loads(written["report.json"])
    rows, energies = {row["method"]: row for row in report["methods"]}, {}
    for norm in ("1_norm", "2_norm"):
        energies[norm] = {method: row[f"energy_{norm}"] for method, row in rows.items()}
    least = energies["2_norm"]
    lowest, kept = (cf.read_field(folder / name) for name in ("lowest.npz", "field.npz"))
    assert lowest.energy(2).total == pytest.approx(min(least.values()), rel=1e-9)
    assert [*least.values()] == pytest.approx(sorted(least.values()), rel=1e-8)
    assert (report["best"], report["kept"], report["failures"]) == (next(iter(rows)), "bend", {})
    assert kept.energy(2).total == pytest.approx(least["bend"], rel=1e-9)
    assert kept.facts().items() <= rows["bend"].items()
    for better, worse in (
        ("start", "greedy"),
        ("search", "greedy"),
        ("power + QP", "power"),
        ("polyvector + QP", "polyvector"),
    ):
        assert least[better] <= least[worse] + 1e-7
    assert energies["1_norm"]["MILP"] <= energies["1_norm"]["greedy"] + 1e-7
    # At its limit Ipopt returns an intermediate point, which may be worse.
    lower = least["two-stage"] <= least["MILP"] + 1e-7
    assert lower or rows["two-stage"]["status"] == "limit-with-point"
    assert all(row["worst_violation"] < 1e-6 for row in rows.values() if "status" in row)
    assert report["seconds"] > sum(rows[method]["seconds"] for method in ("start", "search"))


@pytest.mark.slow
def test_a_run_states_what_is_proven_of_every_field(tmp_path, capsys):
    command = ["run", "skew", "--size", "4", "--time-limit", "4", "--threads", "1"]
    assert invoke([*command, "-o", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    report = json.loads((tmp_path / "report.json").read_text())
    certificate = cf.read_certificate(tmp_path / report["proof"]["certificate"])
    assert report["proof"]["status"] == certificate.status == "optimal"
    assert report["proof"]["bound_2_norm"] == certificate.bound
    for row in report["methods"]:
        energy, gap = row["energy_2_norm"], row["gap_2_norm"]
        assert row["bound_2_norm"] == certificate.bound <= energy
        assert gap == (0.0 if row["proven_optimal"] else (energy - certificate.bound) / energy)
    rows = {row["method"]: row for row in report["methods"]}
    assert rows["prove"]["proven_optimal"] is rows[report["best"]]["proven_optimal"] is True
    assert rows["power"]["gap_2_norm"] > 0.01
    assert "least 2-norm energy, proven optimal: " in out
    assert f"{certificate.bound:.10g}; certificate: {tmp_path / 'certificate.npz'}" in out


def test_a_run_on_a_mesh_file_writes_fields_and_a_report(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_obj(Path("box.obj"), box(1))
    assert invoke(["run", "box.obj", "-o", "out", "--time-limit", "1"]) == 0
    shown = capsys.readouterr().out
    assert "faces whose lines are less than 45 degrees apart" in shown
    assert "pixel" not in shown
    assert shown.startswith("searches take at most ")
    assert cf.read_field("out/field.npz").energy().total == pytest.approx(0.0, abs=1e-9)
    written = {path.name for path in Path("out").iterdir()}
    assert written >= {"field.rawfield", "field.obj", "lowest.npz", "models", "report.json", "index.html"}
    facts = json.loads(Path("out/report.json").read_text())
    assert {method["method"] for method in facts["methods"]} >= {"greedy", "power", "search"}
    assert facts["methods"][0]["singularities"] == 8
    assert "12 faces of a mesh" in Path("out/index.html").read_text()


# The page in a browser: what it shows, its layers, and its width, contrast and links


@pytest.fixture
def folder(two_parts):
    return two_parts[0]


@pytest.fixture
def address(folder):
    with served(folder) as site:
        yield f"{site}/index.html"


def displayed(browser, layer):
    return browser.execute_script(f"return getComputedStyle(document.getElementById('{layer}')).display")


@pytest.mark.slow
def test_layers_are_switched(browser, address):
    browser.get(address)
    assert (displayed(browser, "crosses"), displayed(browser, "streamlines-u")) == ("none", "inline")
    find(browser, "#show-crosses").click()
    find(browser, "#show-streamlines-u").click()
    assert (displayed(browser, "crosses"), displayed(browser, "streamlines-u")) == ("inline", "none")


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_and_can_be_read(browser, address, width, scheme):
    show(browser, width=width, scheme=scheme)
    browser.get(address)
    browser.execute_script("document.querySelectorAll('details').forEach(each => each.open = true)")
    check_legibility(browser, width)


@pytest.mark.slow
def test_links_lead_to_files_and_nothing_comes_from_elsewhere(folder):
    page = (folder / "index.html").read_text(encoding="utf-8")
    links = re.findall(r'href="((?!data:)[^"]+)"', page)
    assert len(links) > 34
    assert [link for link in links if not (folder / link).exists()] == []
    assert re.findall(r'(?:src|href)="(?:https?:)?//', page) == []
    report = json.loads((folder / "report.json").read_text())
    assert ("before the surface had settled" in page) == report["surface"]["interrupted"]


@pytest.mark.slow
def test_the_line_that_reads_an_answer_back_reads_it(folder, monkeypatch):
    instance = cf.read_instance(next((folder / "models").glob("*.instance.json")))
    problem = cf.formulate(instance, "milp-mccormick")
    stem = f"{instance.name}.milp-mccormick"
    page = (folder / "index.html").read_text(encoding="utf-8")
    (line,) = re.findall(rf"^crossfield read {stem}\.mps\.sol .*$", page, re.MULTILINE)
    write_point(folder / f"{stem}.mps.sol", problem, problem.point(cf.greedy_field(instance)))
    monkeypatch.chdir(folder)
    assert invoke(shlex.split(line.removesuffix("</pre>"))[1:]) == 0
    assert (folder / f"{stem}.npz").exists()


@pytest.mark.slow
def test_the_first_line_works_with_what_a_plain_installation_has(folder, monkeypatch):
    page = (folder / "index.html").read_text(encoding="utf-8")
    first, *_ = re.findall(r"<pre[^>]*>([^<]*)", page)
    monkeypatch.chdir(folder)
    program, *arguments = shlex.split(first)
    assert program == "crossfield"
    assert invoke([*arguments, "--time-limit", "2"]) == 0
    assert list((folder / arguments[-1]).glob("*.field.npz"))


# Compiling


@pytest.mark.slow
def test_what_proofs_call_is_compiled_once_and_before_the_time_limit_begins(tmp_path):
    # The clock passes the time limit while the functions are compiled, and stands still otherwise.
    program = """
import crossfield as cf
from crossfield.models.processes.deadline import Deadline
from numba.core.event import install_recorder

lines, again = [], []
deadline = Deadline(500.0, lambda: 1000.0 * any("compiling" in line for line in lines))
with install_recorder("numba:compile") as compiled:  # a child process compiles
    proof = cf.prove(cf.sample("skew", 4), limits=cf.Limits(500.0).until(deadline), progress=lines.append)
    assert (proof.ended, proof.status, len(proof.levels) > 0) == ("optimal", "optimal", True)
    assert "compiling" in lines[0] and proof.seconds < 500
    cf.prove(cf.sample("mouse", 8), norm=1, work=1, progress=again.append)
    assert not any("compiling" in line for line in again)
assert not compiled.buffer
"""

    def call(*command):
        settings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "NUMBA_OPT": "1"}  # in less time
        assert subprocess.run([sys.executable, *command], env=settings, check=False).returncode == 0
        times = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache").rglob("*.nb?")}
        return {path: time for path, time in times.items() if not path.name.startswith("parts.")}

    kept, options = call("-c", program), ["--time-limit", "100", "-o", str(tmp_path)]
    assert any(path.name.startswith("clusters.") for path in kept)
    assert kept == call("-m", "crossfield", "prove", "mouse", "--size", "8", *options)
    assert (tmp_path / "mouse.proof.certificate.npz").exists()


@pytest.mark.slow
def test_a_run_that_is_stopped_while_it_compiles_has_the_fields_of_untimed_methods(tmp_path):
    program = """
import sys
import crossfield as cf

seen = []
stop = lambda: "compiling" in seen[-1]
report = cf.run(cf.sample("skew", 4), sys.argv[1], limits=cf.Limits(1.0), progress=seen.append, stop=stop)
print(report.interrupted, [each.method for each in report.candidates])
"""
    settings = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-c", program, str(tmp_path / "out")]
    done = subprocess.run(command, env=settings, capture_output=True, text=True, check=True)
    interrupted, methods = done.stdout.split(maxsplit=1)
    assert (interrupted, "'bend'" in methods, "'search'" in methods) == ("compiling", True, False)
    assert json.loads((tmp_path / "out" / "report.json").read_text())["interrupted"] == "compiling"
