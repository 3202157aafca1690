"""Verification of a library: every damage is named, also under new checksums."""

import gzip
import json
import shutil
from functools import partial

import pytest
from children import complaints
from command_line import invoke
from crossfield.export.formats.registry import FORMATS
from crossfield.export.library.building import entry_files
from crossfield.export.library.building.build import build
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.documents.documents import read_library
from crossfield.export.library.ledger.ledger import Record, add_record
from forging import change, seal
from libraries import defects, document, library_of, rebuild

SPEC = """formulations = ["milp-mccormick", "miqp-mccormick", "minlp-parity", "qp-fixed"]
[rungs.medium]
sizes = [4]
formats = ["nl", "mps"]
compress = true
[[sketches]]
name = "rand"
random = "full"
seeds = [1]
points = "greedy"
"""
STEM = "cf_rand_n004_s1"
MILP, QP, ABOUT = f"{STEM}_milp.json", f"{STEM}_qp.json", f"{STEM}.about.json"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library of one instance in four formulations, with a run in its ledger; not to be changed."""
    lib = library_of(tmp_path_factory.mktemp("built"), SPEC).folder
    sidecar = document(lib, f"{STEM}_milp")
    bound = 0.5 * sidecar["best"]["objective"]
    facts = {"bound": bound, "seconds": 1.5, "threads": 1, "time_limit": 2.0}
    add_record(lib, Record(sidecar["name"], sidecar["problem_sha256"], "HiGHS", "1.0", "limit", **facts))
    rebuild(lib)
    assert document(lib, f"{STEM}_milp")["bound"] == bound
    return lib


@pytest.fixture
def lib(built, tmp_path):
    """A copy that a test may change."""
    return shutil.copytree(built, tmp_path / "lib")


def edit(file, **values):
    """Changes keys of a JSON document."""
    return lambda lib: change(lib / file, **values)


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


def cut_off(file):
    return lambda lib: (lib / file).write_bytes((lib / file).read_bytes()[:-40])


def missing(file):
    return lambda lib: (lib / file).unlink()


def written(file):
    return lambda lib: (lib / file).write_text("{}")


def link(lib):
    (lib / "LICENSE").unlink()
    (lib / "LICENSE").symlink_to("/etc/passwd")


def record(**facts):
    """Replaces the records of the ledger by one."""
    stated = {"entry": f"{STEM}_milp", "problem_sha256": "0" * 64, "solver": "S", "version": "1"}
    return edit("ledger.json", records=[stated | {"status": "feasible"} | facts])


SUMS = {
    f"{STEM}_milp.nl.gz": (text(f"{STEM}_milp.nl.gz", b"\x1f", b"\x1e"), "has another SHA-256 than"),
    "README.md": (text("README.md", b"e", b"E"), "has another SHA-256 than"),
    f"{STEM}_qp.mps.gz": (missing(f"{STEM}_qp.mps.gz"), "is missing"),
    QP: (missing(QP), "is missing"),
    "notes.txt": (written("notes.txt"), "is not in SHA256SUMS"),
    "more": (lambda lib: (lib / "more").mkdir(), "is a folder, a link or a temporary file"),
    "LICENSE": (link, "is a folder, a link or a temporary file"),
    ".a.mps.x.part": (written(".a.mps.x.part"), "is a folder, a link or a temporary file"),
}
"""Files that a checksum or a list of names condemns: how each is changed, and words of its defect."""
SEALED = {
    f"{STEM}_milp.mps.gz": packed(f"{STEM}_milp.mps.gz", b" 1.5707963267948966\n", b" 1.5707963267948968\n"),
    f"{STEM}_miqp.nl.gz": cut_off(f"{STEM}_miqp.nl.gz"),
    f"{STEM}_qp.nl.gz": packed(f"{STEM}_qp.nl.gz", b"0.7853981633974483", b"0.7853981633974484"),
    f"{STEM}_milp.col": text(f"{STEM}_milp.col", b"alpha_00_00", b"alpha_00_09"),
    f"{STEM}_milp.sol": text(f"{STEM}_milp.sol", b"=obj= ", b"=obj= 1"),
    f"{STEM}_qp.sol": text(f"{STEM}_qp.sol", b"alpha_00_00 ", b"alpha_00_00 7"),
    QP: edit(QP, best__objective=lambda value: value + 1e-7),
    MILP: edit(MILP, bound=1e3, status="optimal", gap=0.0),
    f"{STEM}_miqp.json": edit(f"{STEM}_miqp.json", counts__variables=lambda value: value + 1),
    f"{STEM}_parity.json": edit(f"{STEM}_parity.json", generator="crossfield 0.0.1"),
    ABOUT: edit(ABOUT, fields__least_2__energy_2norm=0.0),
    f"{STEM}.instance.json": text(f"{STEM}.instance.json", b'"w_beta": 1e-06', b'"w_beta": 0.5'),
    "library.json": edit("library.json", skipped=lambda _: {"cf_cat_n002": "a whim"}),
    "library.solu": text("library.solu", b"=", b"~"),
    "CITATION.cff": text("CITATION.cff", b"title", b"Title"),
    "entries.csv": text("entries.csv", b"rand", b"Rand"),
    "check_point.py": text("check_point.py", b"1e-8", b"1e-1"),
}
"""Changes of a file under new checksums: a build makes another one."""
REFUSED = {
    "no checksums": (missing("SHA256SUMS"), "SHA256SUMS", "cannot be read"),
    "no index": (missing("library.json"), "lib", "is no library"),
    "a damaged index": (written("library.json"), "library.json", "is not a file of this kind"),
    "no document of an instance": (missing(ABOUT), ABOUT, "cannot be read"),
    "a path to the instance": (edit(ABOUT, instance__file="../other.json"), ABOUT, "does not match"),
    "a path in the ledger": (record(point="../x.field.json"), "ledger.json", "does not match"),
    "an unknown key": (edit("library.json", more=lambda _: 1), "library.json", "more"),
    "a number that is none": (
        edit(ABOUT, fields__least_2__seconds=float("nan")),
        ABOUT,
        "a number that is not finite",
    ),
    "a bound in the ledger": (
        edit("ledger.json", records=lambda records: [records[0] | {"bound": 1e-3}]),
        MILP,
        "is not what a build makes",
    ),
    "a record of nothing": (record(entry="cf_more_n003_qp"), "ledger.json", "is not what a build makes"),
    "a record without its field": (
        record(point=f"{STEM}_milp.field.json"),
        f"{STEM}_milp.field.json",
        "cannot be read",
    ),
    "a damaged field": (written(f"{STEM}.field.json"), f"{STEM}.field.json", ""),
    "a file that nothing names": (written("notes.txt"), "notes.txt", "belongs to nothing"),
    "another program": (
        edit("library.json", generator="crossfield 0.0.1"),
        "library.json",
        "was made by crossfield 0.0.1",
    ),
}
"""Changes under new checksums that end the build, or that are named in other words."""


def test_every_file_that_differs_from_its_checksum_or_has_none_is_named(lib, capsys):
    for spoil, _ in SUMS.values():
        spoil(lib)
    assert invoke(["library", "verify", str(lib)]) == 1
    lines = complaints(capsys.readouterr().err).splitlines()
    named = dict(line.removeprefix("crossfield: ").split(": ", 1) for line in lines)
    assert len(named) == len(lines)
    assert all("; " in what for what in named.values())
    assert SUMS.keys() <= named.keys()
    for name, (_, words) in SUMS.items():
        assert named[name].startswith(words)
    assert invoke(["library", "verify", str(lib), "--json"]) == 1
    assert {defect["file"] for defect in json.loads(capsys.readouterr().out)} == named.keys()


@pytest.mark.parametrize(
    "old, new, words",
    [
        (b"  README.md", b"  ../README.md", "no checksum of a plain file name"),
        (b"  README.md", b"  LICENSE", "or repeats one"),
        (b"a", b"b", "SHA-256"),
    ],
)
def test_damaged_checksums_are_named(lib, old, new, words):
    text("SHA256SUMS", old, new)(lib)
    assert words in " ".join(defects(lib).values())


def test_every_change_under_new_checksums_is_found(lib):
    for spoil in SEALED.values():
        spoil(lib)
    seal(lib)
    found = defects(lib)
    assert found.keys() == SEALED.keys()
    assert all(what.startswith("is not what a build makes; ") for what in found.values())


@pytest.mark.parametrize("name", REFUSED)
def test_inputs_that_no_build_takes_are_found(name, lib):
    spoil, file, words = REFUSED[name]
    spoil(lib)
    if "checksums" not in name:
        seal(lib)
    found = defects(lib)
    assert words in found[file]
    for what in found.values():
        assert "\n" not in what
        assert "; " in what
        assert str(lib) not in what


def test_a_point_is_checked_by_the_exact_program(tmp_path, monkeypatch):
    """Also where the build makes a wrong one."""
    monkeypatch.setattr(entry_files, "_miplib_lines", lambda best: iter([b"=obj= 0\n"]))
    found = defects(library_of(tmp_path, SPEC.replace("4]", "3]")).folder)
    assert {what.partition(" against")[0] for what in found.values()} == {"is not feasible"}
    assert len(found) == 3


def test_a_built_library_has_no_defects(built, capsys):
    assert invoke(["library", "verify", str(built)]) == 0
    assert "no defects found" in capsys.readouterr().out
    assert invoke(["library", "verify", str(built), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


def test_the_remedy_of_a_defect_removes_it(lib):
    """A library is built again, after a file that differs under its own checksum is removed."""
    text(f"{STEM}_milp.col", b"alpha_00_00", b"alpha_00_09")(lib)
    seal(lib)
    (lib / f"{STEM}_milp.sol").write_text("half")
    (lib / f"{STEM}_milp.col").unlink()
    build(read_library(lib).spec, lib, force=True)
    assert verify_library(lib) == []


@pytest.mark.parametrize("path", [".", "absent", "archive.tar.gz"])
def test_another_file_than_a_library_is_one_line(path, tmp_path, capsys):
    (tmp_path / "archive.tar.gz").write_bytes(b"\x1f\x8b")
    assert invoke(["library", "verify", str(tmp_path / path)]) == 1
    shown = complaints(capsys.readouterr().err)
    assert shown.count("\n") == 1
    assert shown.startswith("crossfield: ")


@pytest.mark.slow
def test_all_formulations_and_formats_verify(tmp_path):
    every = SPEC.partition("\n")[2].replace(
        'formats = ["nl", "mps"]\ncompress = true', 'facets = ["hull", "printed"]'
    )
    library = library_of(tmp_path, every)
    assert len(library.entries) == 11
    for entry in library.entries:
        assert {file["format"] for file in entry["files"]} | set(entry["refused"]) == {*FORMATS, "sol"}
    assert verify_library(tmp_path / "lib") == []
    assert read_library(tmp_path / "lib").document == library.document
