"""Whether a reward prefers to be quick: what a learner is told about arriving sooner.

A shipped agent drives from the starts of suite ``nominal`` to within so many metres of the goal.
From there on it goes on itself, or another controller takes over. Both continuations are scored by
several rewards and discounts: where the quicker one has the smaller return, a learner that values
returns like that is right to be slow.

    python benchmarks/learning/reward_preferences.py
    python benchmarks/learning/reward_preferences.py --agent tqc --rivals field mpc --distances 1 3
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import gymnasium
import numpy as np

from defmanip_gym.baselines.controller import Controller
from defmanip_gym.baselines.factories import make_controller
from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.baselines.registry import registered_controllers
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.evaluation.suites import suite_named
from defmanip_gym.task_params import RewardParams, TaskParams

REWARDS = {
    "v0": RewardParams(),
    "approach 2, 1": RewardParams(approach_speed_per_m=2.0, approach_swing_rad_per_m=1.0),
    "approach 4, 2": RewardParams(approach_speed_per_m=4.0, approach_swing_rad_per_m=2.0),
    "approach 4, 2, time 0.1": RewardParams(
        approach_speed_per_m=4.0, approach_swing_rad_per_m=2.0, time_cost_per_step=0.1
    ),
    "no closeness": RewardParams(closeness_weight=0.0),
    "time 0.1": RewardParams(time_cost_per_step=0.1),
}
DISCOUNTS = (0.955, 0.98, 0.995)
STEPS = 1000


@dataclass(frozen=True, kw_only=True)
class Continuation:
    """From where the other takes over: seconds to the end, (n,), and returns by discount."""

    seconds: np.ndarray
    returns: dict[float, np.ndarray]
    arrived: np.ndarray


def continuation(
    first: Controller, then: Controller, reward: RewardParams, distance_m: float
) -> Continuation:
    """Drive by ``first`` to within a distance, then by ``then``, from the suite's starts."""
    starts = np.array([scenario.start for scenario in suite_named("nominal").scenarios])
    count = len(starts)
    env = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0",
        num_envs=count,
        inner_loop="measured_force",
        autoreset_mode="Disabled",
        task=TaskParams(reward=reward),
    )
    observation, info = env.reset(options={"start": starts})
    running, taken = np.ones(count, dtype=bool), np.zeros(count, dtype=bool)
    steps, arrived = np.zeros(count), np.zeros(count, dtype=bool)
    returns = {discount: np.zeros(count) for discount in DISCOUNTS}
    states, start = [None, None], np.ones(count, dtype=bool)
    for _ in range(STEPS):
        takes_over = ~taken & (info["distance_to_goal"] < distance_m)
        taken |= takes_over
        decided = []
        for number, (controller, begins) in enumerate(((first, start), (then, start | takes_over))):
            actions, states[number] = controller.predict(observation, states[number], begins)
            decided.append(actions)
        actions = np.where(taken[:, None], decided[1], decided[0])
        observation, rewards, terminated, truncated, info = env.step(
            np.where(running[:, None], actions, 0.0)
        )
        counted = running & taken
        for discount, total in returns.items():
            total += np.where(counted, discount**steps * rewards, 0.0)
        steps += counted
        arrived |= running & info["is_success"]
        start = np.zeros(count, dtype=bool)
        running &= ~(terminated | truncated)
        if not running.any():
            break
    env.close()
    return Continuation(seconds=0.02 * steps, returns=returns, arrived=arrived)


def main() -> None:
    """Print a row for each distance, rival, reward and discount."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--agent", default="sac")
    parser.add_argument("--rivals", nargs="+", default=["field"])
    parser.add_argument("--distances", nargs="+", type=float, default=[1.0, 3.0])
    words = parser.parse_args()
    agent, config = load_agent(words.agent), TransportConfig(inner_loop="measured_force")
    print(
        "| from, m | rival | reward | γ | seconds: agent, rival | returns | quicker is preferred |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for distance_m in words.distances:
        for name in words.rivals:
            rival = make_controller(registered_controllers()[name], config)
            for told, reward in REWARDS.items():
                own = continuation(agent, agent, reward, distance_m)
                other = continuation(agent, rival, reward, distance_m)
                both = own.arrived & other.arrived
                quicker = other.seconds < own.seconds
                for discount in DISCOUNTS:
                    mine, theirs = own.returns[discount], other.returns[discount]
                    preferred = np.where(quicker, theirs > mine, mine > theirs)[both].mean()
                    print(
                        f"| {distance_m:g} | {name} | {told} | {discount:g} "
                        f"| {own.seconds[both].mean():.2f}, {other.seconds[both].mean():.2f} "
                        f"| {mine[both].mean():.2f}, {theirs[both].mean():.2f} "
                        f"| {preferred:.0%} |",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
