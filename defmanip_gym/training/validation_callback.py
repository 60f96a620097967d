"""Scores the policy during training on starts that it neither trains nor is judged on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.vec_env import VecEnv

from defmanip_gym.evaluation.seeds import VALIDATION_SEED

_KEPT = ("score", "best_score", "last_mean_reward", "best_mean_reward")


class ValidationCallback(EvalCallback):
    """Evaluates the deterministic policy at intervals, and tells when it has become better.

    Every evaluation begins with the same starts, and whatever else the episodes draw: where they
    differ much, of two evaluations on others the one with the nearer starts would have won.

    The score is the mean over episodes of the share of time left when the goal was reached, 0 for
    episodes that did not reach it or violated the constraint.

    Args:
        env: of its own, normalized as the training's.
        episodes: per evaluation.
        interval: steps of the batch between evaluations.
        on_best: called when no earlier policy was better.
        log_path: folder for the evaluations' results; None writes none.
    """

    def __init__(
        self,
        env: VecEnv,
        *,
        episodes: int,
        interval: int,
        on_best: Callable[[], None],
        log_path: str | None = None,
    ) -> None:
        super().__init__(
            env,
            n_eval_episodes=episodes,
            eval_freq=max(1, interval),
            log_path=log_path,
            verbose=0,
            warn=False,
        )
        self.score, self.best_score = 0.0, 0.0
        self._on_best = on_best
        self._episode_scores: list[float] = []

    def state(self) -> dict[str, Any]:
        """Return what a checkpoint keeps."""
        return {name: getattr(self, name) for name in _KEPT}

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what ``state`` returned."""
        for name in _KEPT:
            setattr(self, name, state[name])

    def _log_success_callback(self, locals_: dict[str, Any], globals_: dict[str, Any]) -> None:
        super()._log_success_callback(locals_, globals_)
        if locals_["done"]:
            info = locals_["info"]
            episode, limit = info["episode"], self.eval_env.get_attr("max_episode_steps")[0]
            arrived = bool(info["is_success"]) and episode["cost"] == 0
            self._episode_scores.append((1.0 - episode["l"] / limit) if arrived else 0.0)

    def _on_step(self) -> bool:
        self._episode_scores = []
        if self.n_calls % self.eval_freq == 0:
            self.eval_env.seed(VALIDATION_SEED)  # of the reset that the evaluation begins with
        if not super()._on_step():
            return False
        if self._episode_scores:
            self.score = self._mean_score()
            self.logger.record("eval/score", self.score)
            if self.score >= self.best_score:
                self.best_score = self.score
                self._on_best()
        return True

    def _mean_score(self) -> float:
        return float(np.mean(self._episode_scores))
