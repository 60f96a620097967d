"""Constrained learning: the price of violating σ adapts until the limit on the cost is kept."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from defmanip_gym.errors import ParameterError
from defmanip_gym.validation import require_non_negative, require_positive


class LagrangianPenalty(BaseCallback):
    """Maximizes the return subject to a limit on the mean cost of an episode, by dual ascent.

    Every step's reward becomes r − λ·cost before the algorithm stores it, with ``cost`` from the
    environment's info (1 where ‖z2‖∞ > σ). After every rollout λ ← max(0, λ + η (C − limit)), C
    being the mean cost per episode that ended in it. The environment must go on after violations:
    ``constraint_mode="cost"``.

    E. Altman, *Constrained Markov Decision Processes* (1999); as a baseline for deep learning in
    A. Ray, J. Achiam, D. Amodei, "Benchmarking safe exploration in deep reinforcement learning"
    (2019).

    Args:
        cost_limit: steps beyond σ that an episode may have on average.
        multiplier: λ at the beginning, in units of the normalized reward.
        learning_rate: η.
        largest_multiplier: bound on λ, so that a hopeless beginning does not drown the task.

    Raises:
        ParameterError: values out of range, or an algorithm that learns from a replay buffer.
    """

    def __init__(
        self,
        cost_limit: float = 0.0,
        multiplier: float = 0.1,
        learning_rate: float = 0.01,
        largest_multiplier: float = 10.0,
    ) -> None:
        cost_limit = require_non_negative("cost_limit", cost_limit)
        multiplier = require_non_negative("multiplier", multiplier)
        learning_rate = require_positive("learning_rate", learning_rate)
        largest_multiplier = require_positive("largest_multiplier", largest_multiplier)
        super().__init__()
        self.cost_limit, self.multiplier = cost_limit, multiplier
        self.learning_rate, self.largest_multiplier = learning_rate, largest_multiplier
        self._running = np.zeros(0)  # cost so far of the episodes that run
        self._ended: list[float] = []

    def state(self) -> dict[str, Any]:
        """Return what a checkpoint keeps: the price and, per episode, (n,), the cost so far."""
        return {"multiplier": self.multiplier, "running": self._running}

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what ``state`` returned."""
        self.multiplier, self._running = state["multiplier"], state["running"]

    def _on_training_start(self) -> None:
        if not isinstance(self.model, OnPolicyAlgorithm):
            raise ParameterError(
                "algorithm",
                type(self.model).__name__,
                "an on-policy one, such as PPO",
                "Replayed rewards would hold outdated multipliers.",
            )
        fresh: Any = self.model._last_episode_starts
        if len(self._running) != len(fresh):
            self._running = np.zeros(len(fresh))
        self._running = np.where(fresh, 0.0, self._running)

    def _on_step(self) -> bool:
        costs = np.array([info.get("cost", 0.0) for info in self.locals["infos"]])
        self.locals["rewards"] -= self.multiplier * costs.astype(np.float32)
        self._running += costs
        ended = self.locals["dones"]
        self._ended += self._running[ended].tolist()
        self._running[ended] = 0.0
        return True

    def _on_rollout_end(self) -> None:
        if not self._ended:
            return
        mean = float(np.mean(self._ended))
        raised = self.multiplier + self.learning_rate * (mean - self.cost_limit)
        self.multiplier = float(np.clip(raised, 0.0, self.largest_multiplier))
        self.logger.record("lagrangian/cost_per_episode", mean)
        self.logger.record("lagrangian/multiplier", self.multiplier)
        self._ended = []
