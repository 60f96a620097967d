"""Actions as they are handed to wrappers, checked."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import ActionError
from defmanip_gym.validation import number_array

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


def finite_actions(actions: Any, awake: BoolArray, shape: tuple[int, ...] = (3,)) -> Array:
    """Return the actions of a batch as numbers, (n, ...), zero where they do not matter.

    Args:
        actions: as given to an environment.
        awake: whose action matters, (n,).
        shape: of one action.

    Raises:
        ActionError: actions that are not finite or of another shape.
    """
    shape = (len(awake), *shape)
    values = number_array(actions)
    if values is not None and values.shape == shape and not awake.all():
        values[~awake] = 0.0
    if values is None or values.shape != shape or not np.isfinite(values).all():
        raise ActionError("action", actions, f"finite numbers of shape {shape}", "Check them.")
    return values
