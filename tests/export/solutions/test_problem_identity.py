"""A solution belongs to one problem: files, solvers and manifests mean the same one."""

import shutil
from pathlib import Path

import crossfield as cf
import pytest
from command_line import invoke
from crossfield.export.runs.methods import METHODS, Request
from crossfield.export.solutions.readers.registry import parse_raw
from crossfield.models.search.starts import first_field


@pytest.fixture(scope="module")
def ring():
    """A sample whose greedy field is improved by other jumps: they are not the same data."""
    instance = cf.sample("ring", 8, stroke_weight=0.3, skew_weight=1e-7)
    assert (cf.greedy_field(instance).p != first_field(instance).p).any()
    return instance


@pytest.fixture(scope="module")
def solved(ring, tmp_path_factory):
    """Folders written by `export` and by `solve`, for the same instance and arguments."""
    folder = tmp_path_factory.mktemp("ring")
    path = str(cf.write_instance(ring, folder / "ring.json"))
    assert invoke(["export", path, "-f", "qp-fixed", "-o", str(folder / "files")]) == 0
    assert invoke(["solve", path, "--formulation", "qp-fixed", "-o", str(folder / "solved")]) == 0
    return folder


def only(folder: Path, pattern: str) -> Path:
    (path,) = folder.glob(pattern)
    return path


def read(solution: Path, manifest: Path, field: Path) -> int:
    return invoke(["read", str(solution), "--manifest", str(manifest), "-o", str(field)])


def test_export_and_solve_fix_the_same_jumps_and_either_manifest_reads_the_answer(solved, ring, tmp_path):
    solution = only(solved / "solved", "*.ipopt.sol")
    expected = cf.read_field(only(solved / "solved", "*.field.npz")).energy().total
    for number, folder in enumerate(("files", "solved")):
        manifest = cf.read_manifest(only(solved / folder, "*.manifest.json"))
        assert manifest.problem().jumps.tolist() == first_field(ring).p.tolist()
        assert (manifest.folder / manifest.document["instance"]["file"]).is_file()
        assert read(solution, manifest.path, tmp_path / f"{number}.npz") == 0
        assert cf.read_field(tmp_path / f"{number}.npz").energy().total == pytest.approx(expected)


def test_solve_keeps_what_export_wrote_beside_it(solved, tmp_path):
    """A manifest keeps the other files of the same problem, and drops those of another."""
    folder = tmp_path / "both"
    shutil.copytree(solved / "files", folder)
    instance = only(folder, "*.instance.json")

    def listed():
        manifest = cf.read_manifest(only(folder, "*.manifest.json"))
        return sorted(Path(file["name"]).suffix for file in manifest.document["files"])

    arguments = ["solve", str(instance), "--formulation", "qp-fixed", "-o", str(folder)]
    assert invoke(arguments) == 0
    assert listed() == [".col", ".gms", ".lp", ".mps", ".nl", ".row"]
    greedy = cf.write_field(cf.greedy_field(cf.read_instance(instance)), tmp_path / "greedy.npz")
    assert invoke([*arguments, "--start", str(greedy)]) == 0
    assert listed() == [".col", ".nl", ".row"]


def test_a_stamp_begins_the_hash_of_the_manifest_in_all_files(ring, tmp_path):
    """Also in files that hold the problem with products lifted: they are of the same problem."""
    problem = cf.formulate(ring, "minlp-quartic")
    manifest = cf.write(problem, tmp_path, formats=["mps", "gms"])
    stamp = f"sha256_{manifest.document['sha256'][:11]}"
    assert problem.stamp == problem.lifted.stamp == stamp
    assert f"NAME {ring.name}_{stamp} FREE\n" in only(tmp_path, "*.mps").read_text()
    assert f"put 'problem,{stamp}' /;" in only(tmp_path, "*.gms").read_text()


def test_the_answers_of_gams_carry_the_stamp():
    """A file of an older model has no such line and is read all the same."""
    old = b"model_status,1\nsolver_status,1\nobjective, 2.0\nx, 1.0\n"
    new = parse_raw(old.replace(b"objective", b"problem,sha256_1a2b3c4d5e6\nobjective"))
    assert parse_raw(old).objective == new.objective == 2.0
    assert (parse_raw(old).stamps, new.stamps) == (set(), {"1a2b3c4d5e6"})


def test_a_run_leaves_manifests_beside_its_solves(ring, tmp_path):
    """The second stage's jumps are the MILP's: only a manifest of its own can read its solution."""
    list(METHODS["two-stage"].find(Request(ring, tmp_path, cf.Limits(5.0))))
    manifest = cf.read_manifest(only(tmp_path, "*.qp-fixed.manifest.json"))
    solution = cf.read_solution(only(tmp_path, "*.qp-fixed.ipopt.sol"), manifest.problem())
    assert solution.violation.worst < 1e-6
    assert solution.objective < 1e-5  # with other jumps it is 15
