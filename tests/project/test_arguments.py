"""Wrong arguments that would go unnoticed: an error of crossfield that names the argument."""

from dataclasses import replace

import crossfield as cf
import numpy as np
import pytest


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    """An instance, a field and a problem, which the calls below use."""
    instance, folder = cf.sample("mouse", 6), tmp_path_factory.mktemp("folder")
    (folder / "a.sol").write_text("ONE 1\n")
    return {
        "cf": cf,
        "np": np,
        "folder": folder,
        "instance": instance,
        "right": replace(instance, orthogonal=True),
        "field": cf.greedy_field(instance),
        "problem": cf.formulate(instance, "milp-mccormick"),
        "pixel": {"mask": np.ones((1, 1), bool), "stroke_pixels": [[0, 0]], "theta": [0.0], "w": [1.0]},
    }


WRONG = r"""
field.energy(3)                                          | norm is 3; give 1, 2 or 'mixed'
field.energy(True)                                       | norm is True
field.image(field.p)                                     | values has shape (20,); give one value for each
cf.formulate(instance, "qp", p=np.full(20, 0.9))         | p holds something other than whole numbers
cf.formulate(instance, "qp", p=3)                        | p has shape ()
cf.formulate(instance, "milp", relax="no")               | relax is 'no'; give True or False
cf.formulate(instance, "milp", stroke_norm="2")          | stroke_norm is 2; give 1 or 2
cf.formulate(instance, "milp", beta_norm=3)              | beta_norm is 3; give 1 or 2
cf.formulate(instance, "milp", facet=3)                  | no facet 3; choose one of hull
cf.formulate(instance, "milo")                           | ; choose one of minlp-parity
cf.formulate(instance, "MILP")                           | (is it milp?)
cf.formulate(instance, "zzz")                            | in short parity, quartic, cubic, bilin, bilin1
cf.formulate(instance, "milp", norm=1)                   | no option 'norm'
cf.formulate(instance, "cubic", facet="printed")         | minlp-cubic has no option facet
cf.formulate(instance, "qp", relax=True)                 | qp-fixed has no option relax
cf.formulate(instance, "milp", p=[0] * 20)               | milp-mccormick has the jumps as variables; leave
cf.formulate(instance, "qp")                             | qp-fixed takes the jumps of all pairs as data
cf.formulate(instance, "qp", p=[0])                      | p has shape (1,), but the grid has 20 pairs
cf.formulate(instance, "cycle")                          | orthogonal crosses only; make the instance with
cf.formulate(right, "milp-cycle", limits=True)           | milp-cycle has no option limits
cf.formulate(right.with_gauge("box"), "miqp-cycle")      | the gauge box does not at strokes; choose the gauge
cf.formulate(right.with_gauge("box"), "miqp-orthogonal", limits=True) | the gauge box does not at strokes
cf.formulate(instance, "parity").lifted                  | minlp-parity has cosines
problem.objective_value([1])                             | point has shape (1,)
problem.violation("a")                                   | point holds something other than numbers
problem.field([1])                                       | point has shape (1,)
cf.read_sketch("mouse.svg", curvature="colour=red")      | 'c' chooses no strokes; write colour=red
cf.read_sketch("no such file", size=4097)                | size is 4097; choose 1 to 4096
cf.sample("sphere")                                      | no sample 'sphere'; choose one of
cf.sample("torus_patch", 16, silhouette="outer")         | computed, not drawn; choose the silhouette none
cf.sample("mouse", 6, stroke_weight=np.nan)              | stroke_weight is nan; it must be between 0 and
cf.analytic("cone", -1)                                  | size is -1; choose 1 to
cf.analytic("sphere")                                    | no surface 'sphere'; choose one of
cf.random_instance(-1)                                   | seed is -1; choose 0 to
cf.random_instance(1, share=0.0)                         | share is 0.0; choose a number above 0
cf.random_instance(1, mask_share=1.5)                    | mask_share is 1.5; choose a number above 0
cf.random_instance(1, size=1, mask_share=1e-9)           | choose a larger mask_share
cf.Limits(np.nan)                                        | out of range
cf.Limits(gap=-1)                                        | out of range
cf.Limits(threads=-1)                                    | threads must be between 0 and
cf.search(instance, rounds=1, seed=-1)                   | seed is -1; give a whole number of at least 0
cf.search(instance, rounds=1, jobs=1.5)                  | jobs must be between 1 and
cf.search(instance, rounds=1, stop=3)                    | stop is int; give a function
cf.prove(instance, norm="2")                             | norm is '2'; give 1, 2 or 'mixed'
cf.prove(instance, seed=-1)                              | seed is -1
cf.prove(instance, work=0)                               | work is 0; give a whole number of at least 1
cf.polyvector_field(instance, hold=-1)                   | hold is -1; give a number above 0
cf.bend_field(field, harmonic=0)                         | harmonic is 0; give a number above 0
cf.CrossField(instance, ["a"], field.beta, field.p)      | alpha holds something other than numbers
cf.CrossField(instance, [0], field.beta, field.p)        | alpha has shape (1,), but mouse needs (
cf.CrossField(instance, field.alpha, field.beta + np.inf, field.p) | beta holds something other than angles
cf.CrossField(instance, field.alpha, field.beta, field.p + 0.5) | p holds something other than whole numbers
cf.CrossField(instance, field.alpha, field.beta, [2**32] * 20) | p holds something other than whole numbers
cf.CrossField.from_lines(instance, "a", "b")             | u_angle holds something other than numbers
cf.CrossField.from_lines(instance, field.alpha * np.nan, field.beta) | u_angle of pixel 0 is nan, which is not
cf.Instance.on_pixels("a", **pixel | {"mask": [[0.5]]})  | mask holds something other than True and False
cf.Instance.on_pixels("a", **pixel | {"theta": ["x"]})             | theta holds something other than numbers
cf.Instance.on_pixels("a", **pixel | {"stroke_pixels": [[0, 0.5]]}) | stroke_pixels holds something
cf.Instance.on_pixels("a", **pixel, origin=3)                      | origin has shape ()
cf.Instance.on_pixels("a", **pixel, gauge=["box"])       | no gauge ['box']; choose one of strokes, box
cf.entries("cf_skew_n008_exact", "cf_skew_n008_mlip")    | has no entry 'cf_skew_n008_mlip'; is it
cf.entries("x")                                          | crossfield.entries() lists them
cf.entries(rung=3)                                       | there is no rung 3; choose one of tiny
cf.surface(field, flip="no")                             | flip is 'no'; give True or False
cf.surface(field, [cf.Hint(-1, 3, 0.1, 0)])              | row -1, column 3 lies outside the mask of mouse
cf.surface(field, [cf.Hint(0, 0, 0.1, 0)])               | row 0, column 0 lies outside the mask
cf.surface(field, [cf.Hint(2, 2, np.nan, 0)])            | slant of nan degrees
cf.surface(field, [cf.Hint(2, 2, 0.1, np.inf)])          | tilt inf, not a direction
cf.write_all(instance, folder, formats="lp")             | there is no format 'l'; choose one of nl
cf.write_all(instance, folder, formulations="qp")        | there is no formulation 'q'
cf.Instance.on_pixels("a", **pixel, orthogonal="no")      | orthogonal is 'no'; give True or False
cf.Mesh(None, [[0, 1, 2]])                               | vertices holds something other than numbers
cf.read_mesh(folder / "a.obj", boundary="no")            | boundary is 'no'; give True or False
cf.read_mesh(folder / "a.obj", sharp=181)                | sharp is 181; give degrees from 0 to 180
cf.read_mesh(folder / "a.obj", merge=-1)                 | merge is -1; give a distance
cf.read_mesh(folder / "a.obj", sharp_weight=0)           | sharp_weight is 0; give a number above 0
cf.read_mesh(folder / "a.obj", weights="cotan")          | no kind of weights 'cotan'; choose
cf.read_solution(folder / "a.sol", problem, identified="no") | identified is 'no'; give True or False
cf.write_all(instance, folder, compress="no")            | compress is 'no'; give True or False
"""


@pytest.mark.parametrize(
    "line", WRONG.strip().splitlines(), ids=lambda line: line.rpartition(" | ")[0].strip()
)
def test_a_wrong_argument_is_refused_by_its_name(names, line):
    call, _, words = line.rpartition(" | ")
    with pytest.raises(cf.CrossfieldError) as caught:
        eval(call.strip(), dict(names))
    assert words.strip() in str(caught.value)


def test_numbers_of_numpy_and_iterables_are_accepted(names):
    instance = names["instance"]
    small = cf.random_instance(np.int64(1), size=np.int32(4), share=np.float32(0.5))
    assert small.sha256 == cf.random_instance(1, size=4, share=0.5).sha256
    relaxed = cf.formulate(instance, "milp", relax=np.True_, stroke_norm=np.int64(1))
    assert relaxed.sha256 == cf.formulate(instance, "milp", relax=True, stroke_norm=1).sha256
    assert cf.surface(names["field"], iter(())).heights.shape == cf.surface(names["field"]).heights.shape
