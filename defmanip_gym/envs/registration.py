"""Registers the environments with Gymnasium."""

from __future__ import annotations

from typing import Any

import gymnasium

from defmanip_gym.params import BeamParams, BeamRanges

ENV_ID = "DeformTransport-v0"
RANDOMIZED_ENV_ID = "DeformTransportRandomized-v0"
ENV_IDS = (ENV_ID, RANDOMIZED_ENV_ID)
MAX_EPISODE_STEPS = 1000

RANDOMIZED_DAMPING = (0.05, 1.0)
RANDOMIZED_MASS_SHARES = (0.8, 1.2)


def randomized_ranges() -> BeamRanges:
    """Return what the episodes of ``DeformTransportRandomized-v0`` draw: damping and mass ±20 %."""
    low, high = RANDOMIZED_MASS_SHARES
    mass_kg = BeamParams().mass_kg
    return BeamRanges(damping=RANDOMIZED_DAMPING, mass_kg=(low * mass_kg, high * mass_kg))


def environment_arguments(env_id: str) -> dict[str, Any]:
    """Return the arguments that an id gives its environment, of one of ``ENV_IDS``."""
    return _arguments()[env_id]


def _arguments() -> dict[str, dict[str, Any]]:
    return {ENV_ID: {}, RANDOMIZED_ENV_ID: {"beam_ranges": randomized_ranges()}}


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
