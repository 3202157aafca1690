"""Verification of a library: every damage is named, also under new checksums."""

import gzip
import json
import shutil
from functools import partial

import pytest
from children import complaints
from crossfield.export.cli.app import invoke
from crossfield.export.formats.registry import FORMATS
from crossfield.export.library.building.build import build, rebuild
from crossfield.export.library.building.verification import verify_library
from crossfield.export.library.documents.documents import read_library
from crossfield.export.library.ledger.ledger import Record, add_record
from forging import change, seal
from libraries import library_of
from loops import for_each

pytestmark = pytest.mark.usefixtures("short_searches")

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
MILP, QP, ABOUT = f"{STEM}_milp.json", f"{STEM}_qp.json", f"{STEM}.about.json"


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """A library of one instance in four formulations, with a run in its ledger; not to be changed."""
    lib = library_of(tmp_path_factory.mktemp("built"), SPEC).folder
    sidecar = json.loads((lib / MILP).read_text())
    bound = 0.5 * sidecar["best"]["objective"]
    facts = {"bound": bound, "seconds": 1.5, "threads": 1, "time_limit": 2.0}
    add_record(lib, Record(sidecar["name"], sidecar["problem_sha256"], "HiGHS", "1.0", "limit", **facts))
    assert rebuild(lib).entry(sidecar["name"])["bound"] == bound
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


def link(lib):
    (lib / "README.md").unlink()
    (lib / "README.md").symlink_to("/etc/passwd")


def record(**facts):
    """Replaces the records of the ledger by one."""
    stated = {"entry": f"{STEM}_milp", "problem_sha256": "0" * 64, "solver": "S", "version": "1"}
    return edit("ledger.json", records=[stated | {"status": "feasible"} | facts])


SUMS = {
    "a byte of a packed model": (
        text(f"{STEM}_milp.nl.gz", b"\x1f", b"\x1e"),
        f"{STEM}_milp.nl.gz",
        "another SHA-256",
    ),
    "a byte of a text": (text("README.md", b"e", b"E"), "README.md", "another SHA-256"),
    "a missing file": (missing(f"{STEM}_qp.mps.gz"), f"{STEM}_qp.mps.gz", "is missing"),
    "a missing sidecar": (missing(QP), QP, "is missing"),
    "a missing list of checksums": (missing("SHA256SUMS"), "SHA256SUMS", "is missing"),
    "a missing index": (missing("library.json"), "library.json", "is missing"),
    "a missing document of an instance": (missing(ABOUT), ABOUT, "is missing"),
    "an extra file": (lambda lib: (lib / "notes.txt").write_text("x"), "notes.txt", "not in SHA256SUMS"),
    "a folder": (lambda lib: (lib / "more").mkdir(), "more", "is a folder"),
    "a link": (link, "README.md", "is a link"),
    "a temporary file of a stopped build": (
        lambda lib: (lib / ".a.mps.x.part").write_text(""),
        ".a.mps.x.part",
        "a build that was stopped",
    ),
    "a path in the checksums": (
        text("SHA256SUMS", b"  README.md", b"  ../README.md"),
        "SHA256SUMS",
        "no checksum of a plain file name",
    ),
    "an edited checksum": (text("SHA256SUMS", b"a", b"b"), None, "another SHA-256"),
    "a damaged index": (lambda lib: (lib / "library.json").write_text("{"), "library.json", "SHA-256"),
}
"""Changes beside SHA256SUMS: what is done, and the file and the words of a defect."""
SEALED = {
    "a coefficient of the .mps": packed(
        f"{STEM}_milp.mps.gz", b" 1.5707963267948966\n", b" 1.5707963267948968\n"
    ),
    "a bound in the .nl": packed(f"{STEM}_qp.nl.gz", b"0.7853981633974483", b"0.7853981633974484"),
    "a name in the .col": text(f"{STEM}_milp.col", b"alpha_00_00", b"alpha_00_09"),
    "a packed file that is cut off": cut_off(f"{STEM}_milp.mps.gz"),
    "another count": edit(MILP, counts__variables=lambda value: value + 1),
    "another objective": edit(QP, best__objective=lambda value: value + 1e-7),
    "another bound": edit(MILP, bound=1e3, status="optimal", gap=0.0),
    "another generator of an entry": edit(MILP, generator="crossfield 0.0.1"),
    "a claim in a point": text(f"{STEM}_milp.sol", b"=obj= ", b"=obj= 1"),
    "a value of a point": text(f"{STEM}_milp.sol", b"alpha_00_00 ", b"alpha_00_00 7"),
    "a line in library.solu": text("library.solu", b"=", b"~"),
    "a text": text("CITATION.cff", b"title", b"Title"),
    "a row of the table": text("entries.csv", b"rand", b"Rand"),
    "another checker": text("check_point.py", b"1e-8", b"1e-1"),
    "another energy of a field": edit(ABOUT, fields__least_2__energy_2norm=0.0),
    "another weight of the instance": edit(f"{STEM}.instance.json", w_beta=0.5),
    "a reason to skip": edit("library.json", skipped=lambda _: {"cf_cat_n002": "a whim"}),
}
"""Changes under new checksums, each of one file that is to be named, as the build makes another one."""
REFUSED = {
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
    "a damaged field": (
        lambda lib: (lib / f"{STEM}.field.json").write_text("{}"),
        f"{STEM}.field.json",
        "",
    ),
    "a file that nothing names": (
        lambda lib: (lib / "notes.txt").write_text("x"),
        "notes.txt",
        "belongs to nothing",
    ),
    "another program": (
        edit("library.json", generator="crossfield 0.0.1"),
        "library.json",
        "was made by crossfield 0.0.1",
    ),
}
"""Changes under new checksums that the build refuses, or that are named in other words."""


def check_defects(folder, file, words):
    """Verify a folder, and check that a defect has this file and these words."""
    defects = verify_library(folder)
    for defect in defects:
        assert "\n" not in str(defect)
        assert defect.remedy
        assert str(folder) not in defect.what
    assert [defect for defect in defects if defect.file == (file or defect.file) and words in str(defect)], (
        "\n".join(map(str, defects))
    )
    return defects


@pytest.mark.slow
@for_each("name", SUMS)
def test_a_change_is_found(name, built, tmp_path):
    spoil, file, words = SUMS[name]
    lib = shutil.copytree(built, tmp_path / "lib")
    spoil(lib)
    check_defects(lib, file, words)


@pytest.mark.slow
@for_each("name", SEALED)
def test_a_change_under_new_checksums_is_found(name, built, tmp_path):
    lib = shutil.copytree(built, tmp_path / "lib")
    SEALED[name](lib)
    changed = {path.name for path in lib.iterdir() if path.read_bytes() != (built / path.name).read_bytes()}
    seal(lib)
    assert verify_library(lib)
    (file,) = changed
    check_defects(lib, file, "is not what a build makes")


@pytest.mark.slow
@for_each("name", REFUSED)
def test_inputs_that_no_build_takes_are_found(name, built, tmp_path):
    spoil, file, words = REFUSED[name]
    lib = shutil.copytree(built, tmp_path / "lib")
    spoil(lib)
    seal(lib)
    check_defects(lib, file, words)


def test_a_point_is_checked_by_the_exact_program(built, tmp_path, monkeypatch):
    """Also where the build makes a wrong one."""
    from crossfield.export.library.building import entry_files

    monkeypatch.setattr(entry_files, "_miplib_lines", lambda best: iter([b"=obj= 0\n"]))
    lib = library_of(tmp_path, SPEC.replace("4]", "3]")).folder
    words = {defect.what.partition(" against")[0] for defect in verify_library(lib)}
    assert words == {"is not feasible", "claims another objective than it has"}


def test_a_built_library_has_no_defects(built, capsys):
    assert invoke(["library", "verify", str(built)]) == 0
    assert "no defects found" in capsys.readouterr().out
    assert invoke(["library", "verify", str(built), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


def test_defects_are_one_line_each_and_the_exit_code_is_1(lib, capsys):
    (lib / "notes.txt").write_text("x")
    text("README.md", b"e", b"E")(lib)
    assert invoke(["library", "verify", str(lib), "--jobs", "2"]) == 1
    assert complaints(capsys.readouterr().err).splitlines() == [
        (
            "crossfield: README.md: has another SHA-256 than SHA256SUMS states; fetch it again, "
            "or build the library again with --force"
        ),
        "crossfield: notes.txt: is not in SHA256SUMS; remove it, or build the library again",
    ]
    assert invoke(["library", "verify", str(lib), "--json"]) == 1
    assert [defect["file"] for defect in json.loads(capsys.readouterr().out)] == ["README.md", "notes.txt"]


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
    shown = capsys.readouterr()
    assert complaints(shown.err).count("\n") == 1
    assert complaints(shown.err).startswith("crossfield: ")


@pytest.mark.slow
def test_all_formulations_and_formats_verify(tmp_path):
    text = SPEC.replace(
        'formulations = ["milp-mccormick", "miqp-mccormick", "minlp-parity", "qp-fixed"]\n', ""
    )
    text = text.replace('formats = ["nl", "mps"]\ncompress = true', 'facets = ["hull", "printed"]')
    library = library_of(tmp_path, text)
    assert len(library.entries) == 11
    for entry in library.entries:
        assert {file["format"] for file in entry["files"]} | set(entry["refused"]) == {*FORMATS, "sol"}
    assert verify_library(tmp_path / "lib") == []
    assert read_library(tmp_path / "lib").document == library.document
