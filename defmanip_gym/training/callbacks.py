"""What happens during training besides learning."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from stable_baselines3.common.callbacks import BaseCallback


@runtime_checkable
class Resumable(Protocol):
    """A callback with numbers that an interrupted run must not lose."""

    def state(self) -> dict[str, float]:
        """Return what a checkpoint keeps."""
        ...

    def set_state(self, state: dict[str, float]) -> None:
        """Go on from what ``state`` returned."""
        ...


class Periodically(BaseCallback):
    """Calls a function every so many environment steps, and never twice at one step.

    Args:
        action: what to call.
        interval: environment steps between calls.
    """

    def __init__(self, action: Callable[[], None], interval: int) -> None:
        super().__init__()
        self._action, self._interval = action, max(1, interval)
        self._next = 0

    def _on_training_start(self) -> None:
        self._next = self.num_timesteps + self._interval

    def _on_step(self) -> bool:
        if self.num_timesteps >= self._next:
            self._action()
            self._next += self._interval
        return True
