"""Registers the environments with Gymnasium."""

from __future__ import annotations

import gymnasium

ENV_ID = "DeformTransport-v0"
MAX_EPISODE_STEPS = 1000


def register_environments() -> None:
    """Register every environment of the package; calling it again changes nothing."""
    if ENV_ID in gymnasium.registry:
        return
    gymnasium.register(
        id=ENV_ID,
        entry_point="defmanip_gym.envs.deform_transport:DeformTransportEnv",
        vector_entry_point="defmanip_gym.envs.vector:DeformTransportVectorEnv",
        max_episode_steps=MAX_EPISODE_STEPS,
    )
