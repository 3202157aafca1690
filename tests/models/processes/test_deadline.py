"""Deadlines: the time left, and that the parts of a budget never exceed the whole."""

import math
import pickle

from crossfield.models.processes.deadline import Deadline
from hypothesis import given
from hypothesis import strategies as st

SECONDS = st.floats(1e-3, 1e6)


class Clock:
    """A clock that moves only on request."""

    def __init__(self):
        self.now = 1000.0

    def __call__(self):
        return self.now


@given(SECONDS, st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1), SECONDS, SECONDS)))
def test_the_parts_of_a_budget_are_no_more_than_the_whole(seconds, steps):
    """For any use of their shares, all parts end by the deadline of the whole."""
    clock = Clock()
    whole = Deadline.after(seconds, clock)
    for part, taken, most, kept in steps:
        own = whole.share(part).within(most).later(-kept)
        assert own.at <= whole.at + 1e-9 * seconds
        clock.now += taken * own.left()
    assert clock.now <= whole.at + 1e-9 * seconds


def test_a_deadline_goes_to_another_process():
    """A pickled deadline holds the seconds left, because the other process may have another clock."""
    for seconds in (5.0, math.inf):
        sent, arrived = Deadline.after(seconds), pickle.loads(pickle.dumps(Deadline.after(seconds)))
        assert sent.at <= arrived.at <= Deadline.after(seconds).at
