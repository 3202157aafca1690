"""Tasks in several processes of the package, which Ctrl-C does not reach and which never outlive this one.

The pools of the standard library import the user's program again in every process. They and joblib leave
processes running.
"""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from typing import ParamSpec, TypeVar

from .child import Child
from .job_counts import check_jobs

Task = TypeVar("Task")
Result = TypeVar("Result")
P = ParamSpec("P")


@contextmanager
def parallel_map(work: Callable[[Task], Result], jobs: int) -> Iterator[Callable[[list[Task]], list[Result]]]:
    """A function that does the work on tasks in that many processes; results in the tasks' order.

    work: a function of a module, not of the user's program. Raises the exceptions of the work and of
    `process_pool`.
    """
    with process_pool(jobs) as chosen:
        yield lambda tasks: list(chosen.map(work, tasks))


@contextmanager
def process_pool(jobs: int) -> Iterator[Executor]:
    """Executor with that many processes; a single job runs in this process.

    Functions must belong to a module, not to the user's program. A process starts when there is a task for
    it. All processes end with the block. Raises InputError for a number of jobs that is out of range. Futures
    raise the exceptions of their task, and WorkerError when a process dies or a value cannot be sent.
    """
    if check_jobs(jobs) == 1:
        yield _InProcess()
        return
    with _Processes(jobs) as processes:
        yield processes


class _InProcess(Executor):
    """Executor that runs a task in this process when it is submitted."""

    def submit(self, fn: Callable[P, Result], /, *args: P.args, **kwargs: P.kwargs) -> Future[Result]:
        future: Future[Result] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - the future raises it, as with several jobs
            future.set_exception(error)
        return future


class _Processes(Executor):
    """Child processes, started one by one as tasks come; a thread waits for each."""

    def __init__(self, jobs: int) -> None:
        self._threads = ThreadPoolExecutor(jobs)
        self._children = [Child(one_thread=True) for _ in range(jobs)]
        self._idle: queue.LifoQueue[Child] = queue.LifoQueue()  # started processes come first
        for child in reversed(self._children):
            self._idle.put(child)

    def submit(self, fn: Callable[P, Result], /, *args: P.args, **kwargs: P.kwargs) -> Future[Result]:
        return self._threads.submit(self._ask, partial(fn, *args, **kwargs))

    def __exit__(self, *_: object) -> None:
        """End all processes, whatever they are doing; threads that wait for one then end as well."""
        for child in self._children:
            child.close()
        self._threads.shutdown(cancel_futures=True)

    def _ask(self, work: Callable[[], Result]) -> Result:
        child = self._idle.get()
        try:
            result: Result = child.call(work).value
        finally:
            self._idle.put(child)
        return result
