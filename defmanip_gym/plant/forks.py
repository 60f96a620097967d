"""Batches of simulations in forked processes, where the threads that step them do not exist."""

from __future__ import annotations

import ctypes
import os
from weakref import WeakSet

import mujoco
from mujoco import batch

_made: WeakSet[batch.Batch] = WeakSet()  # a fork tells nobody else which there are


def new_batch(model: mujoco.MjModel, count: int, threads: int) -> batch.Batch:
    """Return a batch that a forked child may drop; to step it there, it must make its own.

    Args:
        model: of all simulations.
        count: number of simulations.
        threads: that step them, 0 for one per CPU.
    """
    made = batch.Batch(model, count, nthread=threads)
    _made.add(made)
    return made


def _keep_forever() -> None:
    """Let nobody destroy a batch that was made before the fork: that waits for its threads."""
    for inherited in _made:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(inherited))


if hasattr(os, "register_at_fork"):  # where there is fork
    os.register_at_fork(after_in_child=_keep_forever)
