"""Specifications of libraries: each fault is refused in one line, and a document states one in full."""

import json

import pytest
from children import complaints
from command_line import invoke
from crossfield.export.library.plan.instances import make_instance
from crossfield.export.library.plan.recipe import plan_library
from crossfield.export.library.plan.spec import DEFAULT, default_spec, read_spec
from crossfield.export.library.plan.spec import spec_of as spec_of_document
from libraries import spec_of, write_spec
from loops import for_each

RUNG = "[rungs.tiny]\nsizes = [4]\n"
SKETCH = '[[sketches]]\nname = "a"\nsample = "mouse"\n'
SEEDS = '[[sketches]]\nname = "a"\nrandom = "full"\nseeds = "1-5"\n'
MESH = '[[sketches]]\nname = "a"\nmesh = "disc"\n'
ON_MESHES = "[rungs.mesh]\n" + MESH
RELEASE = '[release]\nversion = "1"\ndate = "2026-03-01"\nauthors = ["A. Name"]\n'

REFUSED = {
    # The file and its tables
    "no TOML": ("[[[", "not valid TOML"),
    "a number of thousands of digits": (f"[rungs.tiny]\nsizes = [{'9' * 5000}]\n{SKETCH}", "not valid TOML"),
    "another number of thousands": (f"[rungs.tiny]\nsizes = [0x{'f' * 5000}]\n{SKETCH}", "write a smaller"),
    "another kind": (RUNG + SKETCH, "; write format, version, title, tables [rungs.NAME] and [[sketches]]"),
    "unknown key": ('colour = "red"\n' + RUNG + SKETCH, "('colour' was unexpected); write format, version"),
    "no rung": (SKETCH, "'rungs' is a required property; write"),
    "no sketch": (RUNG, "'sketches' is a required property; write"),
    "half a release": ('[release]\nversion = "1"\n' + RUNG + SKETCH, "release: 'date' is a required"),
    "no points": ('points = "gone"\n' + RUNG + SKETCH, "points: there is no file"),
    "a folder as a ledger": ('ledger = "."\n' + RUNG + SKETCH, "ledger: there is no file"),
    # Rungs
    "unknown key of a rung": (RUNG + "speed = 1\n" + SKETCH, "rungs.tiny: Additional properties are not"),
    "no sizes": ("[rungs.tiny]\n" + SKETCH, "rungs.tiny: 'sizes' is a required property; write a table of"),
    "a large size": (RUNG.replace("4", "1000") + SKETCH, "sizes[0]: 1000 is greater than the maximum of 999"),
    "a size twice": (RUNG + "[rungs.small]\nsizes = [4]\n" + SKETCH, "cf_a_n004 is on two rungs"),
    "no format of an entry": (
        f'formulations = ["parity"]\n{RUNG}formats = ["lp"]\n{SKETCH}',
        "no format of the rung of cf_a_n004_parity holds minlp-parity; add nl or gms, or omit it",
    ),
    "no facet of a formulation": (
        f'formulations = ["parity", "milp"]\n{RUNG}facets = ["printed"]\n{SKETCH}',
        "formulations: no rung has minlp-parity; omit it, or add the facet hull to a rung",
    ),
    "no facet of any": ('[rungs.mesh]\nfacets = ["printed"]\n' + MESH, "no rung has minlp-parity; omit it"),
    "tightened, but absent": (
        f'formulations = ["exact"]\n{RUNG}tightened = ["parity"]\n{SKETCH}',
        "rungs.tiny.tightened: there is no formulation 'parity'; choose one of",
    ),
    "tightened, of fixed jumps": (
        f'formulations = ["exact", "qp"]\n{RUNG}tightened = ["qp"]\n{SKETCH}',
        "rungs.tiny.tightened: there is no formulation 'qp'; choose one of",
    ),
    # Sketches
    "no source": (RUNG + '[[sketches]]\nname = "a"\n', "of a name and exactly one of sample, file"),
    "a name twice": (RUNG + SKETCH + SKETCH, "sketches: two have the same name; give each its own"),
    "a path as a name": (RUNG + SKETCH.replace('"a"', '"../a"'), "sketches[0].name: '../a' does not match"),
    "two lines in a name": (RUNG + SKETCH.replace('"a"', '"a\\n"'), "sketches[0].name: "),
    "a long name": (
        'formulations = ["milp-mccormick"]\n[rungs.tiny]\nsizes = [4]\nfacets = ["printed"]\n'
        'gauges = ["box"]\n' + SKETCH.replace('"a"', '"abcdefghijklmn"'),
        "has 39 characters; shorten",
    ),
    "no such drawing": (RUNG + SKETCH.replace("sample", "file"), "sketches[0].file: there is no file"),
    "a damaged drawing": (RUNG + SKETCH.replace('sample = "mouse', 'file = "cut.svg'), "[0].file: cut.svg: "),
    "sizes on no rung": (RUNG + SKETCH + "sizes = { large = [9] }\n", "sketches[0].sizes: there is no rung"),
    "a day without quotes": (RUNG + SKETCH + "added = 2026-02-03\n", "added: .* write a day in quotes"),
    "a day that is none": (RUNG + SKETCH + 'added = "2026-02-30"\n', "'2026-02-30' is not a 'day'; write"),
    "a licence of a number": (RUNG + SKETCH + "license = 4\n", "license: 4 is not of type 'string'; write"),
    "a range that falls": (RUNG + SEEDS.replace("1-5", "5-1"), "sketches[0].seeds: '5-1' must rise"),
    "a range too long": (RUNG + SEEDS.replace("1-5", "1-200000"), "by less than 100000"),
    "a weight below 0": (RUNG + SEEDS + "stroke_weight = -1\n", "; write a number from 0 to 1,000,000"),
    "a share of nothing": (RUNG + SEEDS + "share = 0\n", "; write a number above 0"),
    # Meshes
    "a size of a mesh": (ON_MESHES + "sizes = { mesh = [4] }\n", "[0].sizes: .*meshes have their own"),
    "sizes of meshes": ("[rungs.mesh]\nsizes = [4]\n" + MESH, "rungs.mesh.sizes: .*meshes have their own"),
    "no rung of meshes": (RUNG + MESH, "sketches[0].mesh: no rung takes it; add mesh to rungs"),
    "no rung of pixels": ("[rungs.mesh]\n" + SKETCH, "no rung takes it; add tiny"),
    "another rung": (
        RUNG + ON_MESHES + 'rungs = ["tiny"]\n', "there is no rung 'tiny'; choose one of mesh"
    ),
    "an unknown mesh": (ON_MESHES.replace("disc", "dish"), "there is no mesh 'dish'; choose"),
    "not on meshes": ('formulations = ["milp", "qp"]\n' + ON_MESHES, "no rung has milp-mccormick; omit it"),
}  # fmt: skip


@for_each("fault", REFUSED)
def test_a_fault_is_one_line_with_the_place_and_nothing_is_written(fault, tmp_path, capfd):
    text, words = REFUSED[fault]
    path = write_spec(tmp_path, text)
    (tmp_path / "cut.svg").write_text("<svg><path")
    if fault == "another kind":
        path.write_text('format = "x"\n')
    assert invoke(["library", "build", str(path), "-o", str(tmp_path / "out")]) == 1
    shown = capfd.readouterr()
    line = complaints(shown.err)
    assert (shown.out, line.count("\n")) == ("", 1)
    first, _, second = words.partition(".*")
    assert second in line[line.index(first) :]
    assert "spec.toml: " in line or "cf_a" in line
    assert len(line) < 500 + len(str(tmp_path))
    assert not (tmp_path / "out").exists()


def test_the_specification_that_ships_obeys_its_schema():
    assert read_spec(DEFAULT) == default_spec()


@for_each(
    "text",
    [
        RUNG + SKETCH,
        RELEASE + RUNG + 'formats = ["nl"]\ngauges = ["box"]\nprove = false\ncompress = true\n' + SEEDS,
        RUNG + SEEDS.replace('"1-5"', "[3, 1]") + 'share = 0.3\npoints = "proven"\nadded = "2026-02-03"\n',
        RUNG + SKETCH + ON_MESHES.replace('"a"', '"b"'),
        RUNG + SEEDS + "stroke_weight = 20\nskew_weight = 0.5\n",
    ],
)
def test_the_document_of_a_specification_is_that_specification(text, tmp_path):
    spec = spec_of(tmp_path, text)
    document = json.loads(json.dumps(spec.document()))
    assert spec_of_document(document, tmp_path / "library.json") == spec


def proven(spec):
    """The norms in which the optimum of each instance is proven."""
    return {planned.name: planned.prove for planned in plan_library(spec)}


def test_rungs_and_sketches_decide_on_proofs(tmp_path):
    gauges = 'gauges = ["strokes", "box"]\n'
    sizes = "[rungs.large]\nsizes = [5]\nprove = true\n[rungs.mesh]\n"
    plans = {
        RUNG + gauges + SKETCH: {"cf_a_n004": (2, 1, "mixed"), "cf_a_n004_box": ()},
        RUNG + "prove = false\n" + SKETCH: {"cf_a_n004": ()},
        RUNG + SKETCH + 'points = "greedy"\n': {"cf_a_n004": ()},
        RUNG.replace("tiny", "large") + SKETCH + 'points = "proven"\n': {"cf_a_n004": (2, 1, "mixed")},
        # A mesh may be on the rung of large grids; orthogonal crosses have proofs in the 2-norm alone.
        sizes + MESH + 'rungs = ["large"]\n': {"cf_a_f0054": (2,)},
    }  # fmt: skip
    for text, expected in plans.items():
        assert proven(spec_of(tmp_path, text)) == expected


def test_a_formulation_that_is_listed_by_both_of_its_names_has_one_entry(tmp_path):
    text = 'formulations = ["milp", "milp-mccormick"]\n' + RUNG + 'tightened = ["milp-mccormick", "milp"]\n'
    (planned,) = plan_library(spec_of(tmp_path, text + SKETCH))
    assert [entry.name for entry in planned.entries] == ["cf_a_n004_milp", "cf_a_n004_milp_tight"]


def test_weights_of_a_family_mean_the_same_on_every_grid(tmp_path):
    """Without them, instances have the coefficients of the paper."""
    weighted = SEEDS + "stroke_weight = 20\nskew_weight = 0.5\n"
    for text, size, expected in [(weighted, 3, (160, 32)), (weighted, 6, (80, 8)), (SEEDS, 3, (1, 1e-6))]:
        recipe, *_ = plan_library(spec_of(tmp_path, RUNG.replace("4", str(size)) + text))
        instance = make_instance(recipe)
        assert (instance.stroke_coefficient, instance.skew_coefficient) == pytest.approx(expected)
