"""Objects from files in the environment: who arrives with them, and how much of σ it takes.

python benchmarks/control/payloads.py --episodes 32
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import gymnasium
import numpy as np

from defmanip_gym.baselines.analytic.field import make_controller
from defmanip_gym.payloads.mjcf import MjcfPayload
from defmanip_gym.wrappers.filter_for import payload_filter_for
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper

EXAMPLES = ("hose", "bucket", "spherical")


@dataclass(frozen=True, kw_only=True)
class Course:
    """What n episodes came to; times are of those that arrived, swings until they did."""

    arrived: int
    beyond: int
    median_s: float
    largest_share: float
    changed: float


def driven(env: Any, count: int, steps: int) -> Course:
    """Let ``field`` drive n episodes."""
    config, engine = env.unwrapped.config, env.unwrapped.engine
    controller, state = make_controller(config), None
    observation, _ = env.reset(seed=0)
    arrived, peak = np.full(count, np.nan), np.zeros(count)
    changed = running_steps = 0
    for step in range(steps):
        action, state = controller.predict(observation, state)
        observation, _, _, _, info = env.step(action)
        running = np.isnan(arrived)
        peak = np.where(running, np.maximum(peak, engine.largest_swing_rad), peak)
        changed += int((info.get("intervened", np.zeros(count, dtype=bool)) & running).sum())
        running_steps += int(running.sum())
        arrived[running & info["is_success"]] = (step + 1) * config.task.control_period_s
    shares = peak / config.sigma_rad
    return Course(
        arrived=int((~np.isnan(arrived)).sum()),
        beyond=int((shares > 1.0).sum()),
        median_s=float(np.nanmedian(arrived)),
        largest_share=float(shares.max()),
        changed=changed / running_steps,
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--objects", nargs="+", choices=EXAMPLES, default=EXAMPLES)
    parser.add_argument("--episodes", type=int, default=32)
    parser.add_argument("--seconds", type=float, default=20.0)
    words = parser.parse_args()
    print("| object | | arrive | beyond σ | median time, s | largest, of σ | changed | level |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for name in words.objects:
        path = files("defmanip_gym.objects") / "examples" / f"{name}.xml"
        env: Any = gymnasium.make_vec(
            "defmanip_gym:DeformTransport-v0",
            num_envs=words.episodes,
            payload=MjcfPayload(path=str(path)),
            inner_loop="measured_force",
            constraint_mode="cost",
            autoreset_mode="Disabled",
        )
        made = payload_filter_for(env.unwrapped.config)
        kinds = (
            ("`field`", env, "–"),
            (
                "`field` inside `object_storage`",
                SafetyFilterVectorWrapper(env, made),
                f"{made.level_share:.2f} V_σ",
            ),
        )
        for who, each, level in kinds:
            steps = round(words.seconds / env.unwrapped.config.task.control_period_s)
            course = driven(each, words.episodes, steps)
            print(
                f"| {name} | {who} | {course.arrived} of {words.episodes} | {course.beyond} "
                f"| {course.median_s:.2f} | {course.largest_share:.2f} "
                f"| {100 * course.changed:.1f} % | {level} |"
            )


if __name__ == "__main__":
    main()
