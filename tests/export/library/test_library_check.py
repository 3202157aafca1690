"""Checks of a library: findings of `verify`, and submission of points."""

import gzip
import json
import shutil
from functools import partial

import places
import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.export.formats.registry import FORMATS
from crossfield.export.library.building.build import build
from crossfield.export.library.checking.check_library import verify_library
from crossfield.export.library.documents import check_point
from crossfield.export.library.documents.documents import read_library
from crossfield.export.library.ledger.given import read_points
from crossfield.export.library.plan.spec import read_spec
from crossfield.models.errors import CrossfieldError, InputError, SolutionError
from forging import change, seal
from loops import for_each
from submitting import better_point, submit_one

pytestmark = pytest.mark.usefixtures("short_searches")

SOLUTIONS = places.SOLUTIONS


def everything_below(folder):
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


SPEC = """
format = "crossfield-library-spec"
version = 1
title = "a library for tests"
formulations = ["milp-mccormick", "miqp-mccormick", "minlp-parity", "qp-fixed"]
[rungs.medium]
sizes = [4]
formats = ["nl", "mps"]
compress = true
[[sketches]]
name = "rand"
random = "full"
seeds = [1]
"""
STEM = "cf_rand_n004_s1"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library of one instance in four formulations; not to be changed."""
    folder = tmp_path_factory.mktemp("built")
    (folder / "spec.toml").write_text(SPEC)
    build(read_spec(folder / "spec.toml"), folder / "lib")
    return folder / "lib"


@pytest.fixture
def lib(built, tmp_path):
    """A copy that a test may change."""
    return shutil.copytree(built, tmp_path / "lib")


def edit(file, **given):
    """Changes keys of a JSON document."""
    return lambda lib: change(lib / file, **given)


def text(file, old, new, unpack=bytes, pack=bytes):
    """Replaces the first occurrence of a text."""

    def replace(lib):
        content = unpack((lib / file).read_bytes())
        assert old in content
        (lib / file).write_bytes(pack(content.replace(old, new, 1)))

    return replace


def packed(file, old, new):
    """Replaces the first occurrence of a text in a .gz."""
    return text(file, old, new, gzip.decompress, partial(gzip.compress, mtime=0))


def swap(lib):
    shutil.copy(lib / f"{STEM}_milp.sol", lib / f"{STEM}_miqp.sol")


def link(lib):
    (lib / "README.md").unlink()
    (lib / "README.md").symlink_to("/etc/passwd")


def break_point(lib):
    """The first pixel's alpha leaves its window."""
    lines = (lib / f"{STEM}_milp.sol").read_text().splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith("alpha_"))
    lines[at] = lines[at].split()[0] + " 7.5"
    (lib / f"{STEM}_milp.sol").write_text("\n".join(lines) + "\n")


def record(**given):
    """Replaces the records of the ledger by one."""
    facts = {"entry": f"{STEM}_milp", "problem_sha256": "0" * 64, "solver": "S", "version": "1"}
    return edit("ledger.json", records=[facts | {"status": "feasible"} | given])


def bound_of(value):
    one = {"solver": "S", "version": "1", "bound": value, "status": "limit", "seconds": 1.0}
    bounds = [one | {"threads": 1, "via": None}]
    return {"bounds": bounds, "bound": value, "status": "optimal", "gap": 0.0}


MILP, MIQP, QP = f"{STEM}_milp.json", f"{STEM}_miqp.json", f"{STEM}_qp.json"
PLAIN = {
    "a byte of a model": (
        text(f"{STEM}_milp.nl.gz", b"\x1f", b"\x1e"),
        f"{STEM}_milp.nl.gz",
        "another SHA-256",
    ),
    "a byte of a text": (text("README.md", b"e", b"E"), "README.md", "another SHA-256"),
    "a missing file": (lambda lib: (lib / f"{STEM}_qp.mps.gz").unlink(), f"{STEM}_qp.mps.gz", "is missing"),
    "a missing sidecar": (lambda lib: (lib / QP).unlink(), QP, "is missing"),
    "a missing list of checksums": (lambda lib: (lib / "SHA256SUMS").unlink(), "SHA256SUMS", "is missing"),
    "a missing index": (lambda lib: (lib / "library.json").unlink(), "library.json", "is missing"),
    "a missing instance": (
        lambda lib: (lib / f"{STEM}.instance.json").unlink(),
        f"{STEM}.instance.json",
        "is missing",
    ),
    "an extra file": (lambda lib: (lib / "notes.txt").write_text("x"), "notes.txt", "not in SHA256SUMS"),
    "a folder": (lambda lib: (lib / "more").mkdir(), "more", "is a folder"),
    "a link": (link, "README.md", "is a link"),
    "a temporary file of a stopped build": (
        lambda lib: (lib / ".a.mps.x.part").write_text(""),
        ".a.mps.x.part",
        "a build that was stopped",
    ),
    "a path upwards in the checksums": (
        text("SHA256SUMS", b"  README.md", b"  ../README.md"),
        "SHA256SUMS",
        "no plain file name",
    ),
    "an absolute path in the checksums": (
        text("SHA256SUMS", b"  README.md", b"  /etc/passwd"),
        "SHA256SUMS",
        "no plain file name",
    ),
    "a line that is no checksum": (
        text("SHA256SUMS", b"  README.md", b" README.md"),
        "SHA256SUMS",
        "no checksum",
    ),
    "a damaged index": (lambda lib: (lib / "library.json").write_text("{"), "library.json", "not valid JSON"),
    "a damaged sidecar": (lambda lib: (lib / QP).write_bytes(b"\xff\xfe"), QP, "not JSON"),
}
SEALED = {
    "a coefficient of the .mps": (
        packed(f"{STEM}_milp.mps.gz", b" 1.5707963267948966\n", b" 1.5707963267948968\n"),
        f"{STEM}_milp.mps.gz",
        "does not hold the problem",
    ),
    "a bound in the .nl": (
        packed(f"{STEM}_qp.nl.gz", b"0.7853981633974483", b"0.7853981633974484"),
        f"{STEM}_qp.nl.gz",
        "does not hold the problem",
    ),
    "a name in the .col": (
        text(f"{STEM}_milp.col", b"alpha_00_00", b"alpha_00_09"),
        f"{STEM}_milp.col",
        "does not hold the problem",
    ),
    "a packed file that is cut off": (
        lambda lib: (lib / f"{STEM}_milp.mps.gz").write_bytes(
            (lib / f"{STEM}_milp.mps.gz").read_bytes()[:-40]
        ),
        f"{STEM}_milp.mps.gz",
        "does not hold the problem",
    ),
    "a file that nothing names": (
        lambda lib: (lib / "notes.txt").write_text("x"),
        "notes.txt",
        "belongs to nothing",
    ),
    "a path in a sidecar": (
        edit(MILP, files=lambda files: [*files, files[0] | {"name": "../../secret.mps"}]),
        MILP,
        "does not match",
    ),
    "a path to the instance": (edit(MILP, instance__file="../other.json"), MILP, "does not match"),
    "a path in the ledger": (record(point="../x.field.json"), "ledger.json", "does not match"),
    "an unknown key": (edit(MILP, files=lambda files: [file | {"more": 1} for file in files]), MILP, "more"),
    "a name that is too long": (
        edit("library.json", entries=lambda names: [*names, "cf_" + "a" * 30]),
        "library.json",
        "does not match",
    ),
    "an entry that is not there": (
        edit("library.json", entries=lambda names: [*names, "cf_more_n003_qp"]),
        "cf_more_n003_qp.json",
        "cannot be read",
    ),
    "other counts": (edit(MILP, counts__variables=lambda value: value + 1), MILP, "another counts"),
    "another class": (edit(MILP, **{"class": "MIQP"}), MILP, "another class"),
    "other ranges": (edit(MIQP, ranges__matrix=[1.0, 2.0]), MIQP, "another ranges"),
    "other curvature": (edit(MIQP, curvature__objective="indefinite"), MIQP, "another curvature"),
    "an unknown formulation": (edit(MILP, formulation="nothing"), MILP, "no entry can have"),
    "a jump beyond all numbers": (edit(QP, jumps=[[0, 10**30]]), QP, "no entry can have"),
    "a jump of no pair": (edit(QP, jumps=[[999, 1]]), QP, "does not have"),
    "an objective beyond all numbers": (edit(QP, best__objective=10**400), f"{STEM}_qp.sol", "has objective"),
    "an objective that is no number": (
        edit(QP, best__objective=float("nan")),
        QP,
        "a number that is not finite",
    ),
    "a bound beyond all numbers": (edit(QP, **bound_of(10**400)), QP, "another bounds"),
    "another option": (edit(MILP, options__facet="printed"), f"{STEM}.instance.json", "is not the instance"),
    "another objective": (
        edit(MIQP, best__objective=lambda value: value + 1e-7),
        f"{STEM}_miqp.sol",
        "has objective",
    ),
    "an entry without a point": (edit(MILP, best=None), MILP, "$.best"),
    "another energy": (
        edit(MIQP, best__energy_2norm=lambda value: value + 1e-7),
        f"{STEM}_miqp.sol",
        "of a field of energy",
    ),
    "the point of another entry": (swap, f"{STEM}_miqp.sol", "the checker refuses it"),
    "a point that is not feasible": (break_point, f"{STEM}_milp.sol", "is not feasible"),
    "a claim that is not so": (
        text(f"{STEM}_milp.sol", b"=obj= ", b"=obj= 1"),
        f"{STEM}_milp.sol",
        "claims objective",
    ),
    "a damaged point": (
        text(f"{STEM}_milp.nl.sol", b"Options", b"Option"),
        f"{STEM}_milp.nl.sol",
        "not a solution file of a known kind",
    ),
    "a bound above a point": (edit(MIQP, **bound_of(1e3)), MIQP, "another bounds"),
    "a status that does not follow": (edit(MIQP, **bound_of(-1.0)), MIQP, "another status"),
    "a bound that is none of the bounds": (edit(QP, bound=-5.0), QP, "another bound "),
    "a fact in library.solu": (
        text("library.solu", b"= " + MILP[:-5].encode(), b"= " + MIQP[:-5].encode()),
        "library.solu",
        "is not what follows",
    ),
    "a line in library.solu": (
        text("library.solu", b"=", b"~"),
        "library.solu",
        "is not what follows",
    ),
    "another checker": (text("check_point.py", b"1e-8", b"1e-1"), "check_point.py", "is not what follows"),
    "a field of another energy": (
        edit(f"{STEM}.about.json", fields__least_2__energy_2norm=0.0),
        f"{STEM}.about.json",
        "other energies",
    ),
    "another instance": (
        edit(f"{STEM}.instance.json", w_beta=0.5),
        f"{STEM}.instance.json",
        "is not the instance",
    ),
    "a record of nothing": (record(entry="cf_more_n003_qp"), "ledger.json", "not in the library"),
    "a record without its field": (
        record(point=f"{STEM}_milp.field.json", point_sha256="0" * 64),
        f"{STEM}_milp.field.json",
        "cannot be read",
    ),
    "another program": (edit(MILP, generator="crossfield 0.0.1"), MILP, "was made by crossfield 0.0.1"),
}


def check_found(folder, file, words):
    found = verify_library(folder)
    for finding in found:
        assert "\n" not in str(finding)
        assert finding.remedy
        assert str(folder) not in finding.what
    assert [finding for finding in found if finding.file == file and words in finding.what], "\n".join(
        map(str, found)
    )
    return found


@pytest.mark.slow
@for_each("what", PLAIN)
def test_a_change_is_found(what, built, tmp_path):
    spoil, file, words = PLAIN[what]
    lib = shutil.copytree(built, tmp_path / "lib")
    spoil(lib)
    check_found(lib, file, words)


@pytest.mark.slow
@for_each("what", SEALED)
def test_a_change_under_new_checksums_is_found(what, built, tmp_path):
    spoil, file, words = SEALED[what]
    lib = shutil.copytree(built, tmp_path / "lib")
    spoil(lib)
    seal(lib)
    found = check_found(lib, file, words)
    assert not [finding for finding in found if "SHA-256" in finding.what and finding.file != "library.json"]


def test_sealing_alone_changes_nothing(lib):
    seal(lib)
    assert verify_library(lib) == []


def test_a_built_library_has_no_defects(built, capsys):
    assert invoke(["library", "verify", str(built)]) == 0
    assert "no defects found" in capsys.readouterr().out
    assert invoke(["library", "verify", str(built), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


def test_findings_are_one_line_each_and_the_exit_code_is_1(lib, capsys):
    (lib / "notes.txt").write_text("x")
    text("README.md", b"e", b"E")(lib)
    assert invoke(["library", "verify", str(lib)]) == 1
    said = capsys.readouterr()
    assert complaints(said.err).splitlines() == [
        (
            "crossfield: README.md: has another SHA-256 than SHA256SUMS states; fetch it again, "
            "or build the library again"
        ),
        "crossfield: notes.txt: is not in SHA256SUMS; remove it, or build the library again",
    ]
    assert invoke(["library", "verify", str(lib), "--json"]) == 1
    assert [finding["file"] for finding in json.loads(capsys.readouterr().out)] == ["README.md", "notes.txt"]


@pytest.mark.parametrize("path", [".", "absent", "archive.tar.gz"])
def test_another_file_than_a_library_is_one_line(path, tmp_path, capsys):
    (tmp_path / "archive.tar.gz").write_bytes(b"\x1f\x8b")
    assert invoke(["library", "verify", str(tmp_path / path)]) == 1
    said = capsys.readouterr()
    assert complaints(said.err).count("\n") == 1
    assert complaints(said.err).startswith("crossfield: ")


# submitting


ENTRY = f"{STEM}_miqp"


@pytest.fixture(scope="module")
def solved(built, tmp_path_factory):
    """HiGHS's better point of an entry, its objective, and the library after it was submitted;
    not to be changed.
    """
    folder = tmp_path_factory.mktemp("solved")
    objective = better_point(built, ENTRY, folder / "found.sol")
    lib = shutil.copytree(built, folder / "lib")
    return folder / "found.sol", objective, lib, submit(folder / "found.sol", lib)


def submit(file, lib):
    facts = {"solver": "HiGHS", "version": "1.15", "seconds": 0.5, "by": "A. Body"}
    return submit_one(lib, file, entry=ENTRY, **facts)


def test_a_better_point_is_kept_with_its_provenance(built, solved):
    _, objective, lib, happened = solved
    before = json.loads((built / f"{ENTRY}.json").read_text())["best"]
    assert happened.better_point
    assert happened.known == before["objective"]
    assert happened.objective == pytest.approx(objective, rel=1e-9)
    assert objective < before["objective"] * (1 - 1e-3)
    best = json.loads((lib / f"{ENTRY}.json").read_text())["best"]
    assert best["objective"] == happened.objective
    assert [best[key] for key in ("solver", "version", "seconds", "by")] == ["HiGHS", "1.15", 0.5, "A. Body"]
    found = check_point.check(str(lib / f"{ENTRY}.mps.gz"), str(lib / f"{ENTRY}.sol"))
    assert float(found.objective) == pytest.approx(objective, rel=1e-9)
    assert found.worst < 1e-12


def test_a_library_verifies_after_a_submission(solved):
    assert verify_library(solved[2]) == []


def test_a_build_from_specification_and_ledger_gives_the_same_library(built, solved, tmp_path):
    lib = solved[2]
    (tmp_path / "spec.toml").write_text(SPEC.replace("title", 'ledger = "ledger.json"\ntitle', 1))
    for path in (lib / "ledger.json", *lib.glob(f"{ENTRY}.field.json")):
        shutil.copy(path, tmp_path)
    build(read_spec(tmp_path / "spec.toml"), tmp_path / "lib")
    assert everything_below(tmp_path / "lib") == everything_below(lib)
    assert everything_below(lib) != everything_below(built)


def test_a_point_that_is_no_better_changes_nothing(solved, tmp_path, capsys):
    file, _, done, _ = solved
    lib = shutil.copytree(done, tmp_path / "lib")
    before = everything_below(lib)
    shutil.copy(lib / f"{ENTRY}.sol", tmp_path / f"{ENTRY}.sol")
    for path in (file, tmp_path / f"{ENTRY}.sol"):
        assert invoke(["library", "submit", str(lib), str(path), "--entry", ENTRY]) == 0
        assert "not better" in capsys.readouterr().out
    assert everything_below(lib) == before


def test_the_entry_is_found_by_the_name_of_the_file_or_by_its_columns(built, solved, tmp_path):
    lib = solved[2]
    for name in (f"{ENTRY}.sol", f"{ENTRY}.of-highs.sol", "anything.sol"):
        shutil.copy(solved[0], tmp_path / name)
        assert submit_one(lib, tmp_path / name).entries == (ENTRY,)


def states(before, after):
    """Files that a stopped submission has written: one by one, checksums last."""
    changed = [name for name in after if after[name] != before.get(name)]
    field, ledger, sums = f"{ENTRY}.field.json", "ledger.json", "SHA256SUMS"
    rest = sorted(set(changed) - {field, ledger, sums})
    assert {field, ledger, sums} <= set(changed)
    sidecars = [name for name in rest if name.count(".") == 1 and name.startswith("cf_")]
    others = [name for name in rest if name not in sidecars and name.startswith("cf_")]
    return {
        "field": [field],
        "ledger": [field, ledger],
        "half of the files": [field, ledger, *others[: len(others) // 2]],
        "all but the sidecars": [field, ledger, *others],
        "the sidecars too": [field, ledger, *others, *sidecars],
        "all but the checksums": [field, ledger, *rest],
    }


@pytest.mark.parametrize(
    "state",
    [
        "field",
        "ledger",
        "half of the files",
        "all but the sidecars",
        "the sidecars too",
        "all but the checksums",
    ],
)
@pytest.mark.slow
def test_the_next_submission_completes_one_that_was_stopped(state, built, solved, tmp_path):
    before, after = everything_below(built), everything_below(solved[2])
    lib = shutil.copytree(built, tmp_path / "lib")
    for name in states(before, after)[state]:
        (lib / name).write_bytes(after[name])
    assert verify_library(lib)
    submit(solved[0], lib)
    assert everything_below(lib) == after


def spoiled(solved, tmp_path, old, new):
    """The point with another value of the first column of a name."""
    lines = solved[0].read_text().splitlines()
    at = next(number for number, line in enumerate(lines) if line.startswith(old))
    lines[at] = new
    (tmp_path / "spoiled.sol").write_text("\n".join(lines) + "\n")
    return tmp_path / "spoiled.sol"


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("alpha_00_00", "alpha_00_00 9.5", "not a feasible point"),
        ("p1_01_00_u", "p1_01_00_u 0.4", "not a feasible point"),
        ("alpha_00_00", "alpha_09_09 0.5", "another instance, formulation or option"),
        ("alpha_00_00", "alpha_00_00 nan", "line"),
    ],
)
def test_an_invalid_point_is_one_line_and_changes_nothing(old, new, words, solved, built, tmp_path, capsys):
    lib = shutil.copytree(built, tmp_path / "lib")
    before = everything_below(lib)
    file = spoiled(solved, tmp_path, old, new)
    assert invoke(["library", "submit", str(lib), str(file), "--entry", ENTRY]) == 1
    said = capsys.readouterr()
    assert complaints(said.err).startswith(f"crossfield: {file}: ")
    assert words in said.err
    assert complaints(said.err).count("\n") == 1
    assert everything_below(lib) == before


@pytest.mark.parametrize(
    "options, words",
    [
        ({"entry": "../x"}, "no entry"),
        ({"entry": "cf_more"}, "no entry"),
        ({"entry": f"{STEM}_milp"}, "another instance, formulation or option"),
        ({"entry": ENTRY, "solver": "x" * 300}, "at most 200"),
    ],
)
def test_wrong_options_are_refused_before_anything_is_written(options, words, solved, built, tmp_path):
    lib = shutil.copytree(built, tmp_path / "lib")
    before = everything_below(lib)
    with pytest.raises(CrossfieldError, match=words):
        submit_one(lib, solved[0], **options)
    assert everything_below(lib) == before


def test_a_file_without_a_point_is_one_line(built, capsys):
    file = SOLUTIONS / "highs-1.15.1_infeasible_style0.sol"
    assert invoke(["library", "submit", str(built), str(file), "--entry", ENTRY]) == 1
    assert "holds no point" in capsys.readouterr().err


def test_a_point_of_another_instance_fits_no_entry(built, solved, tmp_path):
    lines = [line.replace("_00_00", "_07_07") for line in solved[0].read_text().splitlines()]
    (tmp_path / "other.sol").write_text("\n".join(lines) + "\n")
    with pytest.raises(SolutionError, match="fits no entry"):
        submit_one(built, tmp_path / "other.sol")


def test_a_point_below_a_dual_bound_is_refused(solved, lib):
    change(lib / f"{ENTRY}.json", **bound_of(solved[1] * 1.01))
    with pytest.raises(SolutionError, match="that bound is wrong"):
        submit(solved[0], lib)


def test_a_library_of_another_version_takes_no_points(solved, lib):
    change(lib / "library.json", generator="crossfield 0.0.1")
    with pytest.raises(InputError, match="was built by crossfield"):
        submit(solved[0], lib)


def test_an_archive_is_refused_with_the_remedy(solved, built, tmp_path):
    packed = shutil.make_archive(str(tmp_path / "a"), "gztar", built.parent, built.name)
    for refused in (partial(submit, solved[0]), verify_library, read_points):
        with pytest.raises(InputError, match=r"a\.tar\.gz: is a file; unpack it, as with `tar -xzf`"):
            refused(packed)


@pytest.mark.slow
def test_all_formulations_and_formats_verify(tmp_path):
    text = SPEC.replace(
        'formulations = ["milp-mccormick", "miqp-mccormick", "minlp-parity", "qp-fixed"]\n', ""
    )
    text = text.replace('formats = ["nl", "mps"]\ncompress = true', 'facets = ["hull", "printed"]')
    (tmp_path / "spec.toml").write_text(text)
    library = build(read_spec(tmp_path / "spec.toml"), tmp_path / "lib")
    assert len(library.entries) == 11
    for each in library.entries:
        assert {file["format"] for file in each["files"]} | set(each["refused"]) == {*FORMATS, "sol"}
    assert verify_library(tmp_path / "lib") == []
    assert read_library(tmp_path / "lib").document == library.document
