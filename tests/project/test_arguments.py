"""Wrong arguments of public functions: an error of crossfield that names the argument, whatever its kind."""

import inspect

import crossfield as cf
import numpy as np
import pytest
from crossfield.models.errors import CrossfieldError


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    """An instance, a field and a problem, which the calls below use."""
    instance = cf.sample("mouse", 6)
    return {
        "cf": cf,
        "np": np,
        "folder": tmp_path_factory.mktemp("folder"),
        "instance": instance,
        "field": cf.greedy_field(instance),
        "problem": cf.formulate(instance, "milp-mccormick"),
        "pixel": {"mask": np.ones((1, 1), bool), "stroke_pixels": [[0, 0]], "theta": [0.0], "w": [1.0]},
    }


WRONG = """
field.energy(3)                                          | norm is 3; give 1, 2 or 'mixed'
field.energy("2")                                        | norm is '2'; give 1, 2 or 'mixed'
field.energy(True)                                       | norm is True
field.energy(None)                                       | norm is None
field.image(field.p)                                     | values has shape (20,); give one value for each
cf.formulate(instance, "qp", p=np.full(20, 0.9))         | p holds something other than whole numbers
cf.formulate(instance, "qp", p=np.full(20, np.nan))      | p holds something other than whole numbers
cf.formulate(instance, "qp", p=["a"] * 20)               | p holds something other than numbers
cf.formulate(instance, "qp", p=3)                        | p has shape ()
cf.formulate(instance, "milp", relax="no")               | relax is 'no'; give True or False
cf.formulate(instance, "milp", relax=1)                  | relax is 1; give True or False
cf.formulate(instance, "milp", stroke_norm="2")          | stroke_norm is '2'; give a whole number
cf.formulate(instance, "milp", stroke_norm=True)         | stroke_norm is True
cf.formulate(instance, "milp", beta_norm=3)              | beta_norm is 3; give 1 or 2
cf.formulate(instance, "milp", facet=3)                  | no facet 3; choose one of hull
cf.formulate(instance, 3)                                | name is 3; give text
cf.with_integers_fixed(problem, instance)                | field is an Instance; give a CrossField
problem.objective_value([1])                             | point has shape (1,)
problem.violation("a")                                   | point holds something other than numbers
problem.field([1])                                       | point has shape (1,)
problem.point(instance)                                  | field is an Instance; give a CrossField
cf.read_sketch("mouse.svg", curvature="colour=red")      | curvature is 'colour=red'; give a list of texts
cf.sample("mouse", 6.5)                                  | size is 6.5; give a whole number
cf.sample("mouse", "6")                                  | size is '6'; give a whole number
cf.sample("mouse", True)                                 | size is True; give a whole number
cf.sample("mouse", 6, stroke_weight="1")                 | stroke_weight is '1'; give a number
cf.sample("mouse", 6, stroke_weight=np.nan)              | stroke_weight is nan; it must be between 0 and
cf.sample("mouse", 6, skew_weight=None)                  | skew_weight is None; give a number
cf.analytic("cone", -1)                                  | size is -1; choose 1 to
cf.random_instance(-1)                                   | seed is -1; choose 0 to
cf.random_instance(1, share="x")                         | share is 'x'; give a number
cf.random_instance(1, mask_share=True)                   | mask_share is True
cf.random_instance(1, name=3)                            | name is 3; give text or None
cf.Limits("60")                                          | time_limit is '60'; give a number
cf.Limits(True)                                          | time_limit is True
cf.Limits(1, gap=None)                                   | gap is None; give a number
cf.Limits(1, threads=1.5)                                | threads is 1.5; give a whole number
cf.search(instance, rounds=1, seed=-1)                   | seed is -1; give a whole number of at least 0
cf.search(instance, rounds=1, seed="1")                  | seed is '1'; give a whole number
cf.search(instance, rounds=-1)                           | rounds is -1; give a whole number of at least 0
cf.search(instance, rounds=1.5)                          | rounds is 1.5; give a whole number or None
cf.search(instance, rounds=1, jobs=1.5)                  | jobs is 1.5; give a whole number
cf.search(instance, limits=5, rounds=1)                  | limits is 5; give a Limits or None
cf.search(instance, rounds=1, start=instance)            | start is an Instance; give a CrossField or None
cf.search(instance, rounds=1, stop=3)                    | stop is int; give a function
cf.search(instance, rounds=1, progress=3)                | progress is 3; give a function
cf.prove(instance, norm="2")                             | norm is '2'; give 1, 2 or 'mixed'
cf.prove(instance, norm=True)                            | norm is True
cf.prove(instance, norm=[2])                             | norm is [2]
cf.prove(instance, seed=-1)                              | seed is -1
cf.prove(instance, work=0)                               | work is 0; give a whole number of at least 1
cf.polyvector_field(instance, hold=-1)                   | hold is -1; give a number above 0
cf.polyvector_field(instance, hold=np.nan)               | hold is nan; give a number above 0
cf.polyvector_field(instance, tolerance="x")             | tolerance is 'x'; give a number or None
cf.bend_field(field, harmonic=0)                         | harmonic is 0; give a number above 0
cf.bend_field(field, hold="1")                           | hold is '1'; give a number
cf.CrossField(field, field.alpha, field.beta, field.p)   | instance is a CrossField
cf.CrossField(instance, ["a"], field.beta, field.p)      | alpha holds something other than numbers
cf.CrossField(instance, field.alpha + 1j, field.beta, field.p) | alpha holds something other than numbers
cf.CrossField.from_lines(instance, "a", "b")             | u_angle holds something other than numbers
cf.Instance.on_pixels("a", **pixel | {"mask": [[0.5]]})  | mask holds something other than True and False
cf.Instance.on_pixels("a", **pixel | {"mask": [["no"]]})           | mask holds something other than numbers
cf.Instance.on_pixels("a", **pixel | {"theta": ["x"]})             | theta holds something other than numbers
cf.Instance.on_pixels("a", **pixel | {"w": [1j]})                  | w holds something other than numbers
cf.Instance.on_pixels("a", **pixel | {"stroke_pixels": [[0, 0.5]]}) | stroke_pixels holds something
cf.Instance.on_pixels(3, **pixel)                                  | name is 3; give text
cf.Instance.on_pixels("a", **pixel, stroke_coefficient="x")        | stroke_coefficient is 'x'; give a number
cf.Instance.on_pixels("a", **pixel, pixel_size=True)               | pixel_size is True; give a number
cf.Instance.on_pixels("a", **pixel, origin=3)                      | origin has shape ()
cf.Instance.on_pixels("a", **pixel, gauge=["box"])       | no gauge ['box']; choose one of strokes, box
cf.Instance.on_pixels("a", **pixel, source=3)                      | source is 3; give text
instance.with_weights(stroke_weight="1")                 | stroke_weight is '1'; give a number
cf.draw(field, 3)                                        | path is 3; give text or a path
cf.entry(3)                                              | name is 3; give text
cf.entries(rung=3)                                       | rung is 3; give text or None
cf.solve(problem, folder=3)                              | folder is 3; give text or a path or None
cf.surface(field, hints="ab")                            | hints is 'ab'; give a list of Hints
cf.surface(field, hints=[3])                             | hints is [3]; give a list of Hints
cf.surface(field, flip="no")                             | flip is 'no'; give True or False
cf.Hint(0.5, 0, 0.1)                                     | row is 0.5; give a whole number
cf.Light("x")                                            | azimuth is 'x'; give a number
cf.write(problem, None)                                  | path is None; give text or a path
cf.write(problem, folder / "a.lp", start=instance)       | start is an Instance
cf.write_all(instance, folder, formats="lp")             | formats is 'lp'; give a list of texts
cf.write_all(instance, folder, formulations="qp")        | formulations is 'qp'; give a list of texts
cf.write_all(instance, folder, compress="no")            | compress is 'no'; give True or False
cf.write_all(instance, folder, options=3)                | options is 3; give a dictionary or None
cf.write_all(instance, folder, windows=3)                | windows is 3; give a Windows or None
cf.write_problem(problem, folder, dialects=["x"])        | dialects is ['x']; give a dictionary or None
cf.read_solution("a.sol", instance)                      | problem is an Instance
cf.run(instance, folder, limits=3)                       | limits is 3; give a Limits or None
cf.run(instance, folder, drawing=3)                      | drawing is 3; give text or a path or None
"""


@pytest.mark.parametrize(
    "line", WRONG.strip().splitlines(), ids=lambda line: line.rpartition(" | ")[0].strip()
)
def test_a_wrong_argument_is_refused_by_its_name(names, line):
    call, _, words = line.rpartition(" | ")
    with pytest.raises(CrossfieldError) as caught:
        eval(call.strip(), dict(names))
    assert words.strip() in str(caught.value)


def test_numbers_of_numpy_and_iterables_are_accepted(names):
    instance = names["instance"]
    small = cf.random_instance(np.int64(1), size=np.int32(4), share=np.float32(0.5))
    assert small.sha256 == cf.random_instance(1, size=4, share=0.5).sha256
    relaxed = cf.formulate(instance, "milp", relax=np.True_, stroke_norm=np.int64(1))
    assert relaxed.sha256 == cf.formulate(instance, "milp", relax=True, stroke_norm=1).sha256
    assert cf.surface(names["field"], iter(())).heights.shape == cf.surface(names["field"]).heights.shape
    with pytest.raises(TypeError, match="greedy_field"):
        cf.greedy_field(instance, colour=3)


FUNCTIONS = [
    name
    for name in cf.__all__
    if inspect.isfunction(getattr(cf, name)) and name not in {"entries", "samples"}
]
"""Those that take an argument by position."""


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_refuses_a_wrong_first_argument_by_its_name(name):
    function = getattr(cf, name)
    parameters = inspect.signature(function).parameters.values()
    needed = [one for one in parameters if one.kind is one.POSITIONAL_OR_KEYWORD and one.default is one.empty]
    first = next(iter(parameters)).name
    with pytest.raises(CrossfieldError, match=f"^{first} is an object; give "):
        function(*[object()] * max(1, len(needed)))
