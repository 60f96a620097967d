"""Makes ``trajectories.npz``: what DeformTransport-v0 answers to given seeds and actions.

Made once, with version 0.1.0, by ``python tests/envs/trajectories.py``. What changes these
numbers is another task and needs another id.
"""

from pathlib import Path

import gymnasium
import numpy as np

from defmanip_gym.params import BeamParams, DisturbanceParams

STORED = Path(__file__).with_name("trajectories.npz")
STEPS = 90
NOISY = DisturbanceParams(
    force_amplitude_n=2.0,
    force_frequency_rad_s=5.0,
    force_bias_n=0.5,
    force_sensor_noise_n=0.5,
    swing_sensor_noise_rad=0.02,
)
# name → environment id and arguments; episodes of 40 steps, so that several starts are drawn
CASES = {
    "default": ("DeformTransport-v0", {}),
    "randomized": ("DeformTransportRandomized-v0", {}),
    "force": ("DeformTransport-v0", {"control_mode": "force"}),
    "disturbed": ("DeformTransport-v0", {"disturbance": NOISY, "constraint_mode": "penalty"}),
    "segments": (
        "DeformTransport-v0",
        {"beam": BeamParams(segment_count=3), "constraint_mode": "cost"},
    ),
}


def trajectory(name: str) -> dict[str, np.ndarray]:
    """Return observations (steps + 1, 3, size), rewards (steps, 3) and ends of a case."""
    env_id, arguments = CASES[name]
    env = gymnasium.make_vec(
        f"defmanip_gym:{env_id}",
        num_envs=3,
        max_episode_steps=40,
        autoreset_mode="SameStep",
        **arguments,
    )
    observation, _ = env.reset(seed=11)
    observations, rewards, ends = [observation], [], []
    for actions in _actions(env.action_space.shape):
        observation, reward, terminated, truncated, _ = env.step(actions)
        observations.append(observation)
        rewards.append(reward)
        ends.append(terminated | truncated)
    env.close()
    return {
        "observations": np.array(observations),
        "rewards": np.array(rewards),
        "ends": np.array(ends),
    }


def _actions(shape: tuple[int, ...]) -> np.ndarray:
    """Return smooth actions, (steps, n, k), some of them beyond ±1."""
    phase = np.arange(np.prod(shape)).reshape(shape)
    time = np.arange(STEPS)[:, None, None]
    return 0.6 * np.sin(0.13 * time + phase) + 0.6 * np.sin(0.031 * time * (1 + phase % 3))


if __name__ == "__main__":
    np.savez_compressed(
        STORED,
        **{f"{case}/{key}": value for case in CASES for key, value in trajectory(case).items()},
    )
