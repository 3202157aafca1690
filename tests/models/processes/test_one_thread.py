"""BLAS uses one thread while any thread is inside `one_thread`, and its own number afterwards."""

from __future__ import annotations

import threading

import pytest
from crossfield.models.processes.blas_threads import one_thread
from threadpoolctl import ThreadpoolController

MANY = 2


def numbers() -> set[int]:
    return {library["num_threads"] for library in ThreadpoolController().select(user_api="blas").info()}


@pytest.fixture
def many():
    """A BLAS that would take two threads."""
    blas = ThreadpoolController().select(user_api="blas")
    if not blas.info():
        pytest.skip("threadpoolctl controls no BLAS of this machine, for example Accelerate on macOS")
    with blas.limit(limits=MANY):
        if numbers() != {MANY}:
            pytest.skip("the BLAS of this machine takes one thread only")
        yield


def test_overlapping_threads_restore_the_setting(many):
    """The first one leaves while the second one is inside."""
    first_in, second_in, first_out = (threading.Event() for _ in range(3))
    inside = []

    def first() -> None:
        with one_thread():
            first_in.set()
            assert second_in.wait(60)
        first_out.set()

    def second() -> None:
        assert first_in.wait(60)
        with one_thread():
            second_in.set()
            assert first_out.wait(60)
            inside.append(numbers())

    threads = [threading.Thread(target=work) for work in (first, second)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert inside == [{1}]
    assert numbers() == {MANY}
