"""Training speed: env steps per second, and how they divide into collection and updates.

Candidates learn in turn, several rounds, and ratios are taken within a round:

* ours: the package's training setup, its hyperparameters over ``Sb3VecEnv``;
* default: Stable-Baselines3's own hyperparameters on the single environment, for PPO eight of
  them in a ``DummyVecEnv``, as its ``make_vec_env`` makes them.

All with as many PyTorch threads as our training uses. Off-policy candidates first collect what
they need before they update.

    python benchmarks/speed/training.py
    python benchmarks/speed/training.py --algos ppo --steps 32768 --rounds 5
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import torch
import tyro
from rich.console import Console
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.environments import make_training_env
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.model import build_model
from environments import ENV_ID
from throughput import table, write_json
from turns import Figure

Algo = Literal["ppo", "sac"]
_DEFAULTS: dict[str, tuple[type[BaseAlgorithm], int]] = {"ppo": (PPO, 8), "sac": (SAC, 1)}


@dataclass(frozen=True, kw_only=True)
class TrainingConfig:
    """What to measure."""

    algos: tuple[Algo, ...] = ("ppo", "sac")
    """Algorithms, each in our setup and with SB3's defaults."""
    steps: int = 16_384
    """Env steps of PPO in a turn, rounded up to whole rollouts."""
    off_policy_steps: int = 1280
    """Env steps of SAC in a turn."""
    rounds: int = 3
    """How often every candidate takes its turn."""
    torch_threads: int = 1
    """PyTorch threads; our training uses one."""
    rollout_steps: int | None = None
    """Overrides PPO's n_steps everywhere, for trials."""
    learning_starts: int | None = None
    """Overrides SAC's learning_starts everywhere, for trials."""
    json: Path | None = None
    """Also write all figures there."""


class SplitTimer(BaseCallback):
    """Adds up the time of collection and of the whole of one call of ``learn``.

    Attributes:
        collection_s: seconds between the starts and ends of rollouts.
        total_s: seconds between the start and end of training.
        rollouts: how many.
    """

    def __init__(self) -> None:
        super().__init__()
        self.collection_s = self.total_s = 0.0
        self.rollouts = 0
        self._training_began = self._rollout_began = 0.0

    def _on_training_start(self) -> None:
        self._training_began = time.perf_counter()

    def _on_rollout_start(self) -> None:
        self._rollout_began = time.perf_counter()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        self.collection_s += time.perf_counter() - self._rollout_began
        self.rollouts += 1

    def _on_training_end(self) -> None:
        self.total_s += time.perf_counter() - self._training_began


@dataclass(frozen=True, kw_only=True)
class Turn:
    """One turn of one candidate.

    Attributes:
        total_s: seconds per env step.
        collection_s: of them, in rollouts.
        updates: after each rollout; SB3 counts PPO's by epochs.
    """

    total_s: float
    collection_s: float
    updates: float

    @property
    def update_s(self) -> float:
        """Seconds per env step outside rollouts."""
        return self.total_s - self.collection_s


def measure(config: TrainingConfig) -> dict[str, list[Figure]]:
    """Run all candidates, print their figures and return them by algorithm."""
    before = torch.get_num_threads()
    torch.set_num_threads(config.torch_threads)
    console = Console(width=120)
    results = {}
    try:
        for algo in config.algos:
            results[algo] = _figures(algo, _turns(algo, config))
            console.print(table(algo.upper(), results[algo]))
    finally:
        torch.set_num_threads(before)
    if config.json is not None:
        write_json(config.json, results)
    return results


def _turns(algo: Algo, config: TrainingConfig) -> dict[str, list[Turn]]:
    """Return the turns of our setup and of SB3's defaults."""
    makers: dict[str, Callable[[Algo, TrainingConfig], BaseAlgorithm]] = {
        f"{algo.upper()} ours": _ours,
        f"{algo.upper()} default": _default,
    }
    models = {name: make(algo, config) for name, make in makers.items()}
    turns: dict[str, list[Turn]] = {name: [] for name in models}
    try:
        for model in models.values():
            _turn(model, _warm_up_steps(model))
        for _ in range(config.rounds):
            for name, model in models.items():
                steps = config.steps if algo == "ppo" else config.off_policy_steps
                turns[name].append(_turn(model, steps))
    finally:
        for model in models.values():
            if model.env is not None:
                model.env.close()
    return turns


def _figures(algo: Algo, turns: dict[str, list[Turn]]) -> list[Figure]:
    figures = []
    for name, taken in turns.items():
        figures += [
            Figure.of(name, [1 / turn.total_s for turn in taken], "env steps/s"),
            Figure.of(
                f"{name}: time in rollouts",
                [1e6 * turn.collection_s for turn in taken],
                "µs per env step",
            ),
            Figure.of(
                f"{name}: time in updates",
                [1e6 * turn.update_s for turn in taken],
                "µs per env step",
            ),
            Figure.of(
                f"{name}: {'epochs' if algo == 'ppo' else 'updates'}",
                [turn.updates for turn in taken],
                "per rollout",
            ),
        ]
    ours, default = turns.values()
    pairs = list(zip(ours, default, strict=True))
    reference = f"× {algo.upper()} default"
    figures += [
        Figure.of(
            "speed of ours", [other.total_s / own.total_s for own, other in pairs], reference
        ),
        Figure.of(
            "speed of our rollouts",
            [other.collection_s / own.collection_s for own, other in pairs],
            reference,
        ),
    ]
    return figures


def _turn(model: BaseAlgorithm, steps: int) -> Turn:
    """Learn for at least so many env steps."""
    timer = SplitTimer()
    begin, updates = model.num_timesteps, model._n_updates
    model.learn(steps, callback=timer, reset_num_timesteps=False)
    done = model.num_timesteps - begin
    return Turn(
        total_s=timer.total_s / done,
        collection_s=timer.collection_s / done,
        updates=(model._n_updates - updates) / timer.rollouts,
    )


def _warm_up_steps(model: BaseAlgorithm) -> int:
    """Return the env steps after which the first update has been made."""
    if isinstance(model, OffPolicyAlgorithm):
        return model.learning_starts + 2 * model.n_envs
    return 1  # at least one rollout


def _ours(algo: Algo, config: TrainingConfig) -> BaseAlgorithm:
    settings = TrainConfig(algo=algo)
    hyperparameters = load_hyperparameters(None, algo, settings.env_id) | _overrides(algo, config)
    venv = make_training_env(settings, hyperparameters)
    return build_model(algo, settings.seed, hyperparameters, venv)


def _default(algo: Algo, config: TrainingConfig) -> BaseAlgorithm:
    kind, count = _DEFAULTS[algo]
    venv = make_vec_env(ENV_ID, n_envs=count, seed=0)
    return kind("MlpPolicy", venv, seed=0, device="cpu", **_overrides(algo, config))


def _overrides(algo: Algo, config: TrainingConfig) -> dict[str, Any]:
    if algo == "ppo":
        return {} if config.rollout_steps is None else {"n_steps": config.rollout_steps}
    return {} if config.learning_starts is None else {"learning_starts": config.learning_starts}


if __name__ == "__main__":
    measure(tyro.cli(TrainingConfig, description=__doc__))
