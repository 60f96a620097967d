"""The generators that SB3 draws from."""

from __future__ import annotations

import random
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm


def generators_state(model: BaseAlgorithm) -> dict[str, Any]:
    """Return where Python's, NumPy's and torch's generators and the action space's stand."""
    return {
        "python": random.getstate(),
        "numpy": np.random.get_state(legacy=False),  # noqa: NPY002  SB3 draws from it
        "torch": torch.get_rng_state().numpy(),
        "action_space": model.action_space.np_random.bit_generator.state,
    }


def set_generators_state(model: BaseAlgorithm, state: dict[str, Any]) -> None:
    """Go on from what ``generators_state`` returned."""
    version, numbers, spare = state["python"]
    random.setstate((version, tuple(numbers), spare))
    np.random.set_state(state["numpy"])  # noqa: NPY002
    torch.set_rng_state(torch.from_numpy(state["torch"]))
    model.action_space.np_random.bit_generator.state = state["action_space"]
