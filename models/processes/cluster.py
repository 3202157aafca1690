"""The connection to a dask scheduler, whose workers may be on other machines."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import Any, Final

from ..errors import InputError
from .child_program import WorkerError

_PATIENCE: Final = "10s"  # to reach a scheduler


@contextmanager
def connect_cluster(address: str) -> Iterator[Any]:
    """Yield a client of a scheduler.

    Raises InputError without dask or a scheduler there, and WorkerError when scheduler or workers are lost.
    """
    try:
        import distributed
    except ModuleNotFoundError as error:
        raise InputError(
            "a scheduler needs dask; pip install '.[cluster]' in a clone, here and on the workers"
        ) from error
    try:
        client: Any = distributed.Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"no scheduler answers at {address[:100]}; start one with `dask scheduler`, "
            "and give its address, say tcp://host:8786"
        ) from error
    try:
        yield client
    except distributed.KilledWorker as error:
        raise WorkerError(
            "a task ended several workers, probably for lack of memory; see their logs and try again"
        ) from error
    except (CancelledError, distributed.comm.core.CommClosedError) as error:
        raise WorkerError(f"the scheduler at {address[:100]} is gone; start it and try again") from error
    finally:
        client.close()
