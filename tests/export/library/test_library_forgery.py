"""Every forged value of a library is found, also under new checksums, because it is recomputed."""

import copy
import json
import shutil
from pathlib import Path

import crossfield as cf
import pytest
from crossfield.export.library.building.build import build, rebuild
from crossfield.export.library.checking.check_library import verify_library
from crossfield.export.library.documents.documents import problem_of, read_library, read_sidecar
from crossfield.export.library.ledger.ledger import Record, add_record
from crossfield.export.library.ledger.standing import contradicts, cut, is_proven, relative_gap
from crossfield.export.library.plan.spec import read_spec
from crossfield.models.errors import InputError, SolutionError
from forging import seal
from submitting import submit_one

pytestmark = pytest.mark.usefixtures("short_searches")

SPEC = """
format = "crossfield-library-spec"
version = 1
title = "a library for forgers"
formulations = ["milp-mccormick", "miqcp-bilinear-l1", "minlp-cubic", "qp-fixed"]
[rungs.medium]
sizes = [3]
formats = ["nl", "mps"]
[[sketches]]
name = "rand"
random = "full"
seeds = [1]
"""
STEM = "cf_rand_n003_s1"
MILP = f"{STEM}_milp"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library of one instance with a bound of a solver in its ledger; not to be changed."""
    folder = tmp_path_factory.mktemp("forged")
    (folder / "spec.toml").write_text(SPEC)
    library = build(read_spec(folder / "spec.toml"), folder / "lib")
    sidecar = library.entry(MILP)
    bound = 0.5 * sidecar["best"]["objective"]
    add_record(
        library.folder,
        Record(
            MILP,
            sidecar["problem_sha256"],
            "HiGHS",
            "1.0",
            "limit",
            bound=bound,
            seconds=1.5,
            threads=1,
            time_limit=2.0,
        ),
    )
    rebuild(library.folder)
    assert read_sidecar(library.folder / f"{MILP}.json")["bound"] == bound
    assert verify_library(library.folder) == []
    return library.folder


def forgeries(value, path=()):
    """Copies of a document with one value changed to another of its type, and its place."""
    if isinstance(value, dict):
        for key, part in value.items():
            for where, changed in forgeries(part, (*path, key)):
                yield where, value | {key: changed}
    elif isinstance(value, list):
        for place, part in enumerate(value[:2]):
            for where, changed in forgeries(part, (*path, place)):
                yield where, [*value[:place], changed, *value[place + 1 :]]
        if value:
            yield (*path, "less"), value[:-1]
    elif isinstance(value, bool):
        yield path, not value
    elif isinstance(value, int):
        yield path, value + 1
    elif isinstance(value, float):
        yield path, value * 1.01 + 1e-3
    elif isinstance(value, str):
        yield path, ("0" if value[:1] != "0" else "1") + value[1:] if len(value) == 64 else value + "x"
    else:
        yield path, 1.5


def is_of_bytes(where):
    """Whether `seal` sets this right again: the bytes themselves are compared."""
    return where[0] == "files" and where[-1] in {"bytes", "sha256"}


@pytest.mark.slow
@pytest.mark.parametrize("name", [f"{MILP}.json", f"{STEM}_qp.json", f"{STEM}.about.json"])
def test_every_forged_field_is_found(name, built, tmp_path):
    lib = shutil.copytree(built, tmp_path / "lib")
    original = json.loads((lib / name).read_text())
    unseen = []
    for where, document in forgeries(copy.deepcopy(original)):
        if is_of_bytes(where):
            continue
        (lib / name).write_text(json.dumps(document))
        seal(lib)
        if not verify_library(lib):
            unseen.append(where)
    assert unseen == []


def changed(lib: Path, **given):
    document = json.loads((lib / f"{MILP}.json").read_text())
    (lib / f"{MILP}.json").write_text(json.dumps(document | given))
    seal(lib)
    return [str(finding) for finding in verify_library(lib)]


def test_a_forged_bound_does_not_pass_as_optimal(built, tmp_path):
    """Bounds, status, gap, library.solu and the checksums are forged consistently."""
    lib = shutil.copytree(built, tmp_path / "lib")
    sidecar = json.loads((lib / f"{MILP}.json").read_text())
    best = sidecar["best"]["objective"]
    bounds = [each | {"bound": best} for each in sidecar["bounds"]]
    solu = [line for line in (lib / "library.solu").read_text().splitlines() if MILP not in line]
    (lib / "library.solu").write_text("\n".join([*solu, f"=opt= {MILP} {best!r}"]) + "\n")
    found = changed(lib, bounds=bounds, bound=best, status="optimal", gap=0.0)
    assert any("states another bounds than follows" in each for each in found)


def test_a_text_that_was_changed_is_found(built, tmp_path):
    lib = shutil.copytree(built, tmp_path / "lib")
    (lib / "CITATION.cff").write_text((lib / "CITATION.cff").read_text().replace("title", "Title", 1))
    seal(lib)
    assert [finding.file for finding in verify_library(lib)] == ["CITATION.cff"]


def test_a_bound_of_the_ledger_that_a_point_contradicts_is_found(built, tmp_path):
    lib = shutil.copytree(built, tmp_path / "lib")
    ledger = json.loads((lib / "ledger.json").read_text())
    ledger["records"][0]["bound"] = 1e9
    (lib / "ledger.json").write_text(json.dumps(ledger))
    seal(lib)
    found = {finding.file: finding.what for finding in verify_library(lib)}
    assert "has the bound 1000000000.0" in found["ledger.json"]


# bounds beside a feasible point


def test_the_rule_of_bounds():
    """A little above a feasible point a bound is cut to it; far above it is wrong."""
    assert cut(8.4e-9, 1.3e-28) == 1.3e-28
    assert not contradicts(8.4e-9, 1.3e-28)
    assert contradicts(1e-3, 1.3e-28)
    assert cut(0.4, 0.5) == 0.4
    assert is_proven(1.3e-28, cut(8.4e-9, 1.3e-28))
    assert relative_gap(1.3e-28, 1.3e-28) == 0.0


@pytest.mark.parametrize("above, error", [(4e-7, None), (1e-2, InputError)])
def test_a_bound_above_the_point_is_cut_or_refused(above, error, built, tmp_path):
    lib = shutil.copytree(built, tmp_path / "lib")
    sidecar = read_library(lib).entry(MILP)
    best = sidecar["best"]["objective"]
    record = Record(MILP, sidecar["problem_sha256"], "S", "1", "limit", bound=best + above)
    add_record(lib, record)
    if error is not None:
        with pytest.raises(error, match=r"ledger\.json: has the bound .* take its record out"):
            rebuild(lib)
        return
    rebuild(lib)
    again = read_library(lib).entry(MILP)
    assert again["bound"] == best == max(each["bound"] for each in again["bounds"])
    assert (again["status"], again["gap"]) == ("claimed", 0.0)
    assert again["claimed"] == [{"solver": "S", "version": "1"}]
    assert verify_library(lib) == []


# submitting


def test_auxiliary_variables_are_computed_again(built, tmp_path):
    """A point whose residual in an auxiliary row is 1e-6 is as good as its angles and jumps."""
    lib = shutil.copytree(built, tmp_path / "lib")
    problem, point = point_of(lib)
    for name in ("s", "t", "gamma", "psi"):
        point[problem.blocks[name].slice] -= 1e-6
    assert problem.violation(point).worst > 1e-7
    result = submit_one(lib, written(problem, point, tmp_path), entry=MILP)
    assert result.objective == pytest.approx(result.known, abs=1e-8)
    assert result.outcome == "not better"


@pytest.mark.parametrize("block", ["alpha", "beta", "p1", "p2"])
def test_angles_and_jumps_are_not_mended(block, built, tmp_path):
    """Angles and jumps of a solution have to be feasible without corrections."""
    lib = shutil.copytree(built, tmp_path / "lib")
    problem, point = point_of(lib)
    at = problem.blocks[block].slice
    point[at] = problem.blocks[block].upper + (1.0 if block.startswith("p") else 1e-6)
    with pytest.raises(SolutionError, match="not a feasible point"):
        submit_one(lib, written(problem, point, tmp_path), entry=MILP)


def test_fractional_jumps_are_refused(built, tmp_path):
    lib = shutil.copytree(built, tmp_path / "lib")
    problem, point = point_of(lib)
    point[problem.blocks["p1"].slice] = 0.4
    with pytest.raises(SolutionError, match=r"integrality 0\.4"):
        submit_one(lib, written(problem, point, tmp_path), entry=MILP)


def point_of(lib):
    """The problem of an entry and its best known point."""
    sidecar = read_library(lib).entry(MILP)
    problem = problem_of(lib, sidecar)
    return problem, cf.read_solution(lib / sidecar["best"]["point"], problem).point.copy()


def written(problem, point, folder):
    """The point as a list of names and values."""
    from crossfield.export.verify.comparison import names_of
    from crossfield.models.formulations.names import column_names

    lines = [
        f"{name} {value!r}"
        for name, value in zip(names_of(column_names(problem)), point.tolist(), strict=True)
    ]
    path = folder / "mine.sol"
    path.write_text("=obj= 0\n" + "\n".join(lines) + "\n")
    return path
