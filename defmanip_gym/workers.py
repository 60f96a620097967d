"""Where jobs run: in this process, in others of this machine, or in a joblib backend's cluster."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

import joblib
from joblib._parallel_backends import LokyBackend
from joblib.parallel import get_active_backend

_PATIENCE_S = 5.0
_GLANCE_S = 1.0  # between looks at whether the process that started a worker is there

Job = TypeVar("Job")
Result = TypeVar("Result")


@contextmanager
def running(
    function: Callable[[Job], Result], jobs: Sequence[Job], processes: int | None
) -> Iterator[Iterator[Result]]:
    """Run jobs and give their results as they are done; whatever ends the block ends the workers.

    Args:
        function: runs a job; of a module, so that other processes find it.
        jobs: in the order in which they are started.
        processes: as many as cores by default; 1 runs them in this process. A backend chosen by
            ``joblib.parallel_config`` decides itself.
    """
    backend, _ = get_active_backend()
    threads_before = set(threading.enumerate())
    arguments: dict[str, Any] = {}
    if isinstance(backend, LokyBackend):
        arguments = {"initializer": _begin_worker, "initargs": (os.getpid(),)}
    parallel = joblib.Parallel(
        n_jobs=processes or -1, return_as="generator_unordered", batch_size=1, **arguments
    )
    with _sigint_ignored():
        results = parallel(joblib.delayed(function)(job) for job in jobs)
    try:
        yield results
    except BaseException:
        _close(results)
        # joblib's own, which would be cut off by the exit amid giving back semaphores
        for thread in set(threading.enumerate()) - threads_before:
            thread.join(_PATIENCE_S)
        raise
    else:
        _close(results)


def _begin_worker(starter: int) -> None:
    """Leave Ctrl-C to the process that started this one, and end when it is gone.

    One that was killed cannot end its workers, which would go on unseen, beside those that go on
    with their work.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_after, args=(starter,), daemon=True).start()


def _end_after(starter: int) -> None:
    while os.getppid() == starter:
        time.sleep(_GLANCE_S)
    os._exit(1)


def _close(results: Any) -> None:
    with warnings.catch_warnings():  # that some jobs were not waited for is the purpose
        warnings.simplefilter("ignore")
        results.close()


@contextmanager
def _sigint_ignored() -> Iterator[None]:
    """Let processes that are started here ignore Ctrl-C from their very beginning."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
