"""The search starts from the dual of a coarse lattice, the same for any number of threads."""

import subprocess
import sys
from dataclasses import replace

import crossfield as cf
from crossfield.models.proof.dual_start import suggested
from crossfield.models.search.search import search_patches


def test_a_search_is_never_above_what_a_short_proof_finds():
    """Without a round of search: all fields of the bent cylinder that it starts from have the wrong jumps."""
    instance = replace(cf.sample("cylinder_bend", 22), stroke_coefficient=1.0, skew_coefficient=1e-6)
    patches = search_patches(instance, rounds=0, jobs=1).field.energy().total
    one, two = (cf.search(instance, rounds=0, jobs=jobs).field for jobs in (1, 2))
    assert two.energy().total < 2.631 < 2.739 < patches
    assert (one.alpha.tobytes(), one.beta.tobytes()) == (two.alpha.tobytes(), two.beta.tobytes())
    assert one.p.tolist() == two.p.tolist()


def test_what_is_suggested_is_left_out_where_it_would_take_a_good_part_of_the_time():
    field = cf.greedy_field(cf.sample("saddle", 24))
    assert suggested(field, lambda: 4.9, threads=1) == []
    assert suggested(field, lambda: float("inf"), threads=1)
    small = cf.greedy_field(cf.sample("saddle", 8))
    assert suggested(small, lambda: float("inf"), threads=1) == []


def test_small_searches_load_nothing_that_is_compiled():
    search = "cf.search(cf.sample('skew', 6), rounds=0)"
    code = f"import sys, crossfield as cf; {search}; sys.exit('numba' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
