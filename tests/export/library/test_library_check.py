"""Checks of a library: every change and every forged value is found, also under new checksums."""

import gzip
import json
import shutil
from dataclasses import replace
from functools import partial

import places
import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.export.formats.registry import FORMATS
from crossfield.export.library.building.build import rebuild
from crossfield.export.library.building.instance_task import Preparation
from crossfield.export.library.checking.check_entry import instance_findings
from crossfield.export.library.checking.check_library import verify_library
from crossfield.export.library.documents.documents import read_about, read_library
from crossfield.export.library.ledger.ledger import Record, add_record
from crossfield.export.library.plan.recipe import plan
from forging import change, seal
from libraries import library_of
from loops import for_each

pytestmark = pytest.mark.usefixtures("short_searches")

SOLUTIONS = places.SOLUTIONS


SPEC = """formulations = ["milp-mccormick", "miqp-mccormick", "minlp-parity", "qp-fixed"]
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
    return library_of(tmp_path_factory.mktemp("built"), SPEC).folder


@pytest.fixture(scope="module")
def forged_run(built, tmp_path_factory):
    """The library with a bound of a solver in its ledger; not to be changed."""
    lib = shutil.copytree(built, tmp_path_factory.mktemp("run") / "lib")
    sidecar = json.loads((lib / MILP).read_text())
    bound = 0.5 * sidecar["best"]["objective"]
    facts = {"bound": bound, "seconds": 1.5, "threads": 1, "time_limit": 2.0}
    add_record(lib, Record(sidecar["name"], sidecar["problem_sha256"], "HiGHS", "1.0", "limit", **facts))
    assert rebuild(lib).entry(sidecar["name"])["bound"] == bound
    assert verify_library(lib) == []
    return lib


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
    "a text": (text("CITATION.cff", b"title", b"Title"), "CITATION.cff", "is not what follows"),
    "another checker": (text("check_point.py", b"1e-8", b"1e-1"), "check_point.py", "is not what follows"),
    "a field of another energy": (
        edit(f"{STEM}.about.json", fields__least_2__energy_2norm=0.0),
        f"{STEM}.about.json",
        "another fields",
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


def test_an_instance_of_another_recipe_is_found(built):
    (planned,) = plan(read_library(built).spec)
    task = Preparation(replace(planned.recipe, seed=2))
    (finding,) = instance_findings(built, read_about(built / f"{STEM}.about.json"), task)
    assert finding.file == f"{STEM}.instance.json"
    assert finding.what == "is not the instance that follows from the specification"


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


@pytest.mark.slow
@pytest.mark.parametrize("name", [MILP, QP, f"{STEM}.about.json"])
def test_every_forged_field_is_found(name, forged_run, tmp_path):
    lib = shutil.copytree(forged_run, tmp_path / "lib")
    original, unseen = json.loads((lib / name).read_text()), []
    for where, document in forgeries(original):
        if where[0] == "files" and where[-1] in {"bytes", "sha256"}:
            continue  # `seal` sets these right again: the bytes themselves are compared
        (lib / name).write_text(json.dumps(document))
        seal(lib)
        if not verify_library(lib):
            unseen.append(where)
    assert unseen == []


def test_a_forged_bound_does_not_pass_as_optimal(forged_run, tmp_path):
    """Bounds, status, gap, library.solu and the checksums are forged consistently."""
    lib = shutil.copytree(forged_run, tmp_path / "lib")
    sidecar = json.loads((lib / MILP).read_text())
    best, name = sidecar["best"]["objective"], sidecar["name"]
    bounds = [each | {"bound": best} for each in sidecar["bounds"]]
    solu = [line for line in (lib / "library.solu").read_text().splitlines() if name not in line]
    (lib / "library.solu").write_text("\n".join([*solu, f"=opt= {name} {best!r}"]) + "\n")
    change(lib / MILP, bounds=bounds, bound=best, status="optimal", gap=0.0)
    seal(lib)
    assert any("states another bounds than follows" in str(each) for each in verify_library(lib))


@pytest.mark.slow
def test_all_formulations_and_formats_verify(tmp_path):
    text = SPEC.replace(
        'formulations = ["milp-mccormick", "miqp-mccormick", "minlp-parity", "qp-fixed"]\n', ""
    )
    text = text.replace('formats = ["nl", "mps"]\ncompress = true', 'facets = ["hull", "printed"]')
    library = library_of(tmp_path, text)
    assert len(library.entries) == 11
    for each in library.entries:
        assert {file["format"] for file in each["files"]} | set(each["refused"]) == {*FORMATS, "sol"}
    assert verify_library(tmp_path / "lib") == []
    assert read_library(tmp_path / "lib").document == library.document
