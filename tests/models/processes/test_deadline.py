"""Deadlines: the time left, and that the parts of a budget never exceed the whole."""

import math
import pickle
import threading

import pytest
from crossfield.models.errors import InputError
from crossfield.models.processes.deadline import Deadline, stop_function
from hypothesis import given
from hypothesis import strategies as st

SECONDS = st.floats(1e-3, 1e6)


class Clock:
    """A clock that moves only on request."""

    def __init__(self):
        self.now = 1000.0

    def __call__(self):
        return self.now


def test_a_deadline_tells_what_is_left_and_when_it_has_passed():
    clock = Clock()
    deadline = Deadline.after(3.0, clock)
    assert (deadline.left(), deadline.passed()) == (3.0, False)
    clock.now += 2.0
    assert (deadline.left(), deadline.passed()) == (1.0, False)
    clock.now += 5.0
    assert (deadline.left(), deadline.passed()) == (0.0, True)


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


def test_a_request_to_stop_is_a_function_or_an_event():
    happened = threading.Event()
    is_over = stop_function(happened)
    assert not is_over()
    happened.set()
    assert is_over()
    assert stop_function(is_over) is is_over
    assert not stop_function(None)()
    with pytest.raises(InputError, match="stop is bool; give a function"):
        stop_function(True)
