"""A formulation may be named by its short name wherever it is named, as in library entries."""

from dataclasses import replace

import crossfield as cf
import pytest
from crossfield.export.bundle.problem_files import jumps_as_data
from crossfield.export.cli.app import invoke
from crossfield.export.library.documents.documents import Library
from crossfield.export.library.plan.spec import read_spec
from crossfield.models.errors import FormulationError, InputError
from crossfield.models.formulations.catalogue import FORMULATIONS, declaration_of, declare

SPEC = """format = "crossfield-library-spec"
version = 1
title = "a library for tests"
formulations = [{}]
[rungs.tiny]
sizes = [4]
[[sketches]]
name = "mouse"
sample = "mouse"
"""


def test_both_names_of_every_formulation_mean_the_same():
    skewed = cf.sample("mouse", 4)
    for name, declared in FORMULATIONS.items():
        assert declaration_of(name) is declaration_of(declared.short) is declared
        assert declare(declared.short).name == name
        instance = replace(skewed, orthogonal=declared.orthogonal)
        jumps = jumps_as_data(instance, declared.short, None)
        assert cf.formulate(instance, declared.short, p=jumps).name == name
        assert (jumps is None) == (not declared.fixed)


def test_a_word_that_is_near_a_name_is_told_that_name():
    for word, near in (("MILP", "milp"), ("quartc", "quartic"), ("miqp-exakt", "miqp-exact")):
        with pytest.raises(FormulationError, match=rf"no formulation '{word}'") as refusal:
            declare(word)
        assert f"(is it {near}?)" in str(refusal.value)
    with pytest.raises(FormulationError, match=r"in short parity, quartic, cubic, bilin, bilin1, miqp, milp"):
        declare("zzz")


def test_where_no_formulation_is_named_it_is_told_what_was_meant(tmp_path, capfd):
    assert invoke(["solve", "mouse", "--size", "4", "-m", "milp", "-o", str(tmp_path)]) == 2
    assert "milp is a formulation, not a method; write -f milp" in " ".join(capfd.readouterr().err.split())
    names = ["cf_mouse_n008_milp", "cf_mouse_n008_miqp", "cf_skew_n008_milp"]
    library = Library(tmp_path, {"entries": names})
    with pytest.raises(InputError, match=r"'cf_mouse_n008_milp-mccormick' \(is it cf_mouse_n008_milp\?\)"):
        library.entry("cf_mouse_n008_milp-mccormick")


def test_a_specification_may_say_them_and_lists_each_once(tmp_path):
    path = tmp_path / "spec.toml"
    path.write_text(SPEC.format('"milp", "miqp-exact"'))
    assert read_spec(path).formulations == ("milp-mccormick", "miqp-exact")
    path.write_text(SPEC.format('"milp", "milp-mccormick"'))
    with pytest.raises(InputError, match="'milp-mccormick' is listed twice"):
        read_spec(path)
