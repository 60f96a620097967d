"""A trial of an analytic controller: scored as a recipe's is, on the same validation starts."""

from __future__ import annotations

from typing import NamedTuple, cast

import gymnasium
import numpy as np
import optuna
from gymnasium.vector import AutoresetMode

from defmanip_gym.baselines.controller import Controller
from defmanip_gym.baselines.factories import make_controller
from defmanip_gym.baselines.registry import inner_loop_of, registered_controllers
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.errors import GainError
from defmanip_gym.evaluation.seeds import VALIDATION_SEED
from defmanip_gym.training.analytic_spaces import ANALYTIC_SPACES
from defmanip_gym.training.study import is_as_in_the_file
from defmanip_gym.training.tune_config import TuneConfig

_STEPS = "steps"  # an attribute of trials


class Score(NamedTuple):
    """What a controller got.

    Attributes:
        value: mean over episodes of the share of time left when the goal was reached, 0 for
            episodes that did not reach it or violated the constraint.
        steps: of the environment that this took.
    """

    value: float
    steps: int


def analytic_objective(config: TuneConfig, trial: optuna.Trial) -> float:
    """Return a trial's score; the first trial is the controller as it stands.

    Raises:
        TrialPruned: the sampled loop would be unstable with the gains drawn.
    """
    if is_as_in_the_file(trial):
        reference = registered_controllers()[config.algo]
        controller = make_controller(reference, TransportConfig())
    else:
        try:
            controller = ANALYTIC_SPACES[config.algo](trial)
        except GainError as error:
            raise optuna.TrialPruned(str(error)) from error
    score = validation_score(controller, config)
    trial.set_user_attr(_STEPS, score.steps)
    return score.value


def steps_taken(trials: list[optuna.trial.FrozenTrial]) -> int:
    """Return how many steps of the environment trials took together."""
    return sum(trial.user_attrs.get(_STEPS, 0) for trial in trials)


def validation_score(controller: Controller, config: TuneConfig) -> Score:
    """Return a controller's score on the starts that recipes are validated on first."""
    count = config.evaluation_episodes
    env = gymnasium.make_vec(
        f"defmanip_gym:{config.env}",
        num_envs=count,
        num_threads=config.num_threads,
        autoreset_mode=AutoresetMode.DISABLED,
        inner_loop=inner_loop_of(config.algo, controller),
    )
    try:
        return _score(controller, cast(DeformTransportVectorEnv, env.unwrapped), count)
    finally:
        env.close()


def _score(controller: Controller, env: DeformTransportVectorEnv, count: int) -> Score:
    limit = env.max_episode_steps
    observation, _ = env.reset(seed=VALIDATION_SEED)
    running, state = np.ones(count, dtype=np.bool_), None
    episode_start, steps, scores = running.copy(), 0, np.zeros(count)
    while running.any():
        actions, state = controller.predict(observation, state, episode_start, deterministic=True)
        episode_start = np.zeros_like(running)
        steps += int(running.sum())
        observation, _, terminated, truncated, info = env.step(
            np.where(running[:, None], actions, 0.0)
        )
        arrived = running & info["is_success"] & (info["episode_cost"] == 0)
        scores[arrived] = 1.0 - env.engine.steps[arrived] / limit
        running &= ~(terminated | truncated)
    return Score(float(scores.mean()), steps)
