"""What happens during training besides learning."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from stable_baselines3.common.callbacks import BaseCallback, ProgressBarCallback


@runtime_checkable
class Resumable(Protocol):
    """A callback with values that an interrupted run must not lose."""

    def state(self) -> dict[str, Any]:
        """Return what a checkpoint keeps: plain values and arrays."""
        ...

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what ``state`` returned."""
        ...


@dataclass
class Stop:
    """Whether somebody has asked for the end of a run."""

    asked: bool = False


@contextmanager
def stop_on_ctrl_c() -> Iterator[Stop]:
    """Take the first Ctrl-C as a request; a second one interrupts at once, as ever."""
    stop = Stop()

    def ask(*_: Any) -> None:
        if stop.asked:
            raise KeyboardInterrupt
        stop.asked = True

    # signals reach the main thread only; one that somebody else handles, or ignores, is theirs
    is_ours = (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )
    if is_ours:
        signal.signal(signal.SIGINT, ask)
    try:
        yield stop
    finally:
        if is_ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def progress_bar(is_shown: bool) -> Iterator[list[ProgressBarCallback]]:
    """Show progress, if it is wanted, and stop showing it however training ends."""
    if not is_shown:
        yield []
        return
    bar = ProgressBarCallback()
    try:
        yield [bar]
    finally:
        if hasattr(bar, "pbar"):  # else training has not begun
            bar.pbar.close()


class Checkpoints(BaseCallback):
    """Saves between updates, where the whole state of a run is known: a rollout begins.

    Args:
        save: writes a checkpoint.
        interval: environment steps between checkpoints.
        stop: raises KeyboardInterrupt after a checkpoint, once it is asked for.
    """

    def __init__(self, save: Callable[[], None], interval: int, stop: Stop) -> None:
        super().__init__()
        self._save, self._interval, self._stop = save, interval, stop
        self._next, self._has_told = 0, False

    def _on_training_start(self) -> None:
        self._plan()

    def _on_rollout_start(self) -> None:
        if self._stop.asked or self.model.num_timesteps >= self._next:
            self._save()
            self._plan()
        if self._stop.asked:
            raise KeyboardInterrupt

    def _on_step(self) -> bool:
        if self._stop.asked and not self._has_told:
            print("Stopping before the next rollout. Ctrl-C again: at once, without a checkpoint.")
            self._has_told = True
        return True

    def _plan(self) -> None:
        self._next = (self.model.num_timesteps // self._interval + 1) * self._interval
