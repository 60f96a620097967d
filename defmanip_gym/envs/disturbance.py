"""The force that disturbs the grasp."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig

Array = NDArray[np.float64]


def disturbing_force(config: TransportConfig, steps: NDArray[np.int64]) -> Array:
    """Return the force on the end effector, (n, 3) N in the base frame.

    Args:
        config: the environment's definition.
        steps: control periods since the start of each episode, (n,).
    """
    disturbance = config.disturbance
    time_s = steps * config.task.control_period_s
    force = disturbance.force_bias_n + disturbance.force_amplitude_n * np.sin(
        disturbance.force_frequency_rad_s * time_s
    )
    return np.repeat(force[:, None], 3, axis=1)
