"""A horizon of value that grows while a run learns."""

from __future__ import annotations

from typing import Any

from stable_baselines3.common.callbacks import BaseCallback

from defmanip_gym.errors import ParameterError
from defmanip_gym.validation import require_number


class RisingDiscount(BaseCallback):
    """Raises γ from the hyperparameters' own to another one, geometrically in 1 − γ.

    A short horizon learns sooner to arrive, a long one to arrive sooner.

    Args:
        gamma: at the end, in (0, 1).
        begin: share of the run after which it begins to rise.
        end: share at which it has risen.

    Raises:
        ParameterError: values out of range, or an end that is not after the beginning.
    """

    def __init__(self, gamma: float, begin: float = 0.25, end: float = 0.6) -> None:
        super().__init__()
        self.gamma = require_number("gamma", gamma, 1e-6, 1.0 - 1e-6)
        self.begin = require_number("begin", begin, 0.0, 1.0)
        self.end = require_number("end", end, 0.0, 1.0)
        if not self.begin < self.end:
            raise ParameterError("end", end, f"begin < end, begin={begin}", "Exchange them.")
        self._first = 0.0

    def _init_callback(self) -> None:
        model: Any = self.model
        self._first = model.gamma

    def _on_training_start(self) -> None:
        self._set()

    def _on_rollout_start(self) -> None:
        self._set()

    def _on_step(self) -> bool:
        return True

    def _set(self) -> None:
        """Give learner, buffer and normalization the discount of this moment."""
        model: Any = self.model
        done = model.num_timesteps / model._total_timesteps
        share = min(max((done - self.begin) / (self.end - self.begin), 0.0), 1.0)
        gamma = 1.0 - (1.0 - self._first) ** (1.0 - share) * (1.0 - self.gamma) ** share
        buffers = (getattr(model, name, None) for name in ("rollout_buffer", "replay_buffer"))
        for holder in (model, model.get_vec_normalize_env(), *buffers):
            if hasattr(holder, "gamma"):
                holder.gamma = gamma
