"""Trains an adversary, PPO rewarded for swing, through a safety filter, and lets it play.

python benchmarks/attacks/learned_adversary.py --filter storage --steps 1000000
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.filters.family import STORAGE_FILTERS
from defmanip_gym.training.sb3_vec_env import Sb3VecEnv
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper

_EPISODE_STEPS = 300


class RewardsSwing(gymnasium.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """Pays for swing near σ, and most for what the episode has not had yet."""

    def __init__(self, env: gymnasium.vector.VectorEnv[Any, Any, Any], sigma_rad: float) -> None:
        super().__init__(env)
        self._sigma_rad = sigma_rad
        self._best = np.zeros(env.num_envs)

    def reset(self, **arguments: Any) -> tuple[np.ndarray, dict[str, Any]]:
        """Start episodes."""
        self._best[:] = 0.0
        return self.env.reset(**arguments)

    def step(self, actions: Any) -> tuple[Any, ...]:
        """Step; the reward is the attacker's."""
        observation, _, terminated, truncated, info = self.env.step(actions)
        ended = terminated | truncated
        margin = np.where(ended, info["final_info"]["constraint_margin"], 0.0) if ended.any() else 0
        margin = np.where(ended, margin, info["constraint_margin"])
        share = 1 - margin / self._sigma_rad
        reward = share**4 + 20 * np.maximum(share - self._best, 0) - 1.0 * terminated
        self._best = np.where(ended, 0.0, np.maximum(self._best, share))
        return observation, reward, terminated, truncated, info


def make(name: str, beam: BeamParams, count: int) -> tuple[Any, float]:
    """Return a batch inside the filter, and σ."""
    env = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0",
        num_envs=count,
        autoreset_mode=AutoresetMode.SAME_STEP,
        constraint_mode="cost",
        max_episode_steps=_EPISODE_STEPS,
        beam=beam,
    )
    config = env.unwrapped.config
    if name == "none":
        return env, config.sigma_rad
    made = filter_for(config, kind=STORAGE_FILTERS[name])
    return SafetyFilterVectorWrapper(env, made), config.sigma_rad


def main() -> None:
    """Train and play; print a line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--filter", choices=(*STORAGE_FILTERS, "none"), default="storage")
    parser.add_argument("--segments", type=int, default=1)
    parser.add_argument("--damping", type=float, default=0.1)
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--episodes", type=int, default=1024)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, default=Path("results/adversary.jsonl"))
    options = parser.parse_args()
    beam = BeamParams(segment_count=options.segments, damping=options.damping)
    env, sigma_rad = make(options.filter, beam, 128)
    venv = VecNormalize(Sb3VecEnv(RewardsSwing(env, sigma_rad)), gamma=0.98)
    model = PPO(
        "MlpPolicy",
        venv,
        n_steps=64,
        batch_size=2048,
        n_epochs=8,
        gamma=0.98,
        learning_rate=1e-3,
        ent_coef=0.003,
        seed=options.seed,
        device="cpu",
    )
    model.learn(options.steps)
    record = vars(options) | {"output": str(options.output)}
    record |= play(model, venv, options, beam)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    with options.output.open("a") as file:
        file.write(json.dumps(record) + "\n")
    print(json.dumps(record))


def play(model: PPO, venv: VecNormalize, options: Any, beam: BeamParams) -> dict[str, Any]:
    """Let the adversary play, half of the episodes as it explores; return what it reached."""
    env, sigma_rad = make(options.filter, beam, options.episodes)
    observation, info = env.reset(seed=10_000)
    applies_key = "filter_applies" if "filter_applies" in info else None
    largest, broken = np.zeros(options.episodes), np.zeros(options.episodes, dtype=bool)
    running = np.ones(options.episodes, dtype=bool)
    half = options.episodes // 2
    for _ in range(_EPISODE_STEPS - 1):
        seen = venv.normalize_obs(observation)
        actions, _ = model.predict(seen, deterministic=True)
        actions[half:], _ = model.predict(seen[half:], deterministic=False)
        observation, _, terminated, _, info = env.step(actions)
        running &= ~terminated
        share = 1 - info["constraint_margin"] / sigma_rad
        covered = running & (info[applies_key] if applies_key else True)
        largest = np.where(covered, np.maximum(largest, share), largest)
        broken |= covered & (share > 1)
    env.close()
    return {
        "largest_swing_share": float(largest.max()),
        "median_swing_share": float(np.median(largest)),
        "broken": int(broken.sum()),
        "to_the_end": int(running.sum()),
        "sigma_deg": math.degrees(sigma_rad),
    }


if __name__ == "__main__":
    main()
