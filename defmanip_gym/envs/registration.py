"""Registers the environments with Gymnasium."""

from __future__ import annotations

from typing import Any

import gymnasium

from defmanip_gym.disturbance_ranges import DisturbanceRanges
from defmanip_gym.params import BeamParams, BeamRanges
from defmanip_gym.task_params import RewardParams, StartParams, TaskParams

ENV_ID = "DeformTransport-v0"
RANDOMIZED_ENV_ID = "DeformTransportRandomized-v0"
QUICK_ENV_ID = "DeformTransport-v1"
ROBUST_ENV_ID = "DeformTransportRandomized-v1"
ENV_IDS = (ENV_ID, RANDOMIZED_ENV_ID, QUICK_ENV_ID, ROBUST_ENV_ID)
MAX_EPISODE_STEPS = 1000

RANDOMIZED_DAMPING = (0.05, 1.0)
RANDOMIZED_MASS_SHARES = (0.8, 1.2)

# Where v1 differs from v0: only the time counts, and how much of it is left (docs/training.md)
QUICK_REWARD = RewardParams(
    distance_weight_per_m=0.0,
    course_weight_per_rad=0.0,
    closeness_weight=0.0,
    time_to_go_weight_per_s=10.0,
    time_cost_per_step=0.0,
    failure_penalty=20.0,
)

# What the episodes of DeformTransportRandomized-v1 draw, beams as factors on the reference one
ROBUST_FACTORS = {"damping": (0.1, 10.0), "mass_kg": (0.5, 2.0), "length_m": (0.8, 1.2)}
ROBUST_DISTANCE_M = (0.5, 18.0)
ROBUST_DISTURBANCES = DisturbanceRanges(
    force_amplitude_n=(0.0, 2.0),
    force_frequency_rad_s=(1.0, 10.0),
    force_bias_n=(-2.0, 2.0),
    force_sensor_noise_n=(0.0, 0.5),
    swing_sensor_noise_rad=(0.0, 0.02),
)


def randomized_ranges() -> BeamRanges:
    """Return what the episodes of ``DeformTransportRandomized-v0`` draw: damping and mass ±20 %."""
    low, high = RANDOMIZED_MASS_SHARES
    mass_kg = BeamParams().mass_kg
    return BeamRanges(damping=RANDOMIZED_DAMPING, mass_kg=(low * mass_kg, high * mass_kg))


def environment_arguments(env_id: str) -> dict[str, Any]:
    """Return the arguments that an id gives its environment, of one of ``ENV_IDS``."""
    return _arguments()[env_id]


def robust_ranges() -> BeamRanges:
    """Return what beams the episodes of ``DeformTransportRandomized-v1`` draw."""
    beam = BeamParams()
    return BeamRanges(
        **{
            name: (low * getattr(beam, name), high * getattr(beam, name))
            for name, (low, high) in ROBUST_FACTORS.items()
        }
    )


def _arguments() -> dict[str, dict[str, Any]]:
    anywhere = StartParams(distance_m=ROBUST_DISTANCE_M)
    return {
        ENV_ID: {},
        RANDOMIZED_ENV_ID: {"beam_ranges": randomized_ranges()},
        QUICK_ENV_ID: {
            "inner_loop": "measured_force",
            "task": TaskParams(reward=QUICK_REWARD),
        },
        ROBUST_ENV_ID: {
            "inner_loop": "measured_force",
            "task": TaskParams(reward=QUICK_REWARD, start=anywhere),
            "beam_ranges": robust_ranges(),
            "disturbance_ranges": ROBUST_DISTURBANCES,
        },
    }


def register_environments() -> None:
    """Register every environment of the package; calling it again changes nothing."""
    for env_id, kwargs in _arguments().items():
        if env_id not in gymnasium.registry:
            gymnasium.register(
                id=env_id,
                entry_point="defmanip_gym.envs.deform_transport:DeformTransportEnv",
                vector_entry_point="defmanip_gym.envs.vector:DeformTransportVectorEnv",
                max_episode_steps=MAX_EPISODE_STEPS,
                kwargs=kwargs,
            )
