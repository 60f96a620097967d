"""What wrappers need to know of the transport environment that they wrap."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.state import wrappers
from defmanip_gym.errors import ActionError, CertificateError
from defmanip_gym.validation import number_array

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_OBSERVATION_WRAPPERS = (gymnasium.ObservationWrapper, gymnasium.vector.VectorObservationWrapper)
_ACTION_WRAPPERS = (gymnasium.ActionWrapper, gymnasium.vector.VectorActionWrapper)
# Gymnasium's wrappers that have a step of their own and hand the action on as it is
_KEEPING = {
    "gymnasium.wrappers.common": {
        "TimeLimit",
        "PassiveEnvChecker",
        "OrderEnforcing",
        "RecordEpisodeStatistics",
    },
    "gymnasium.wrappers.rendering": {"RenderCollection", "RecordVideo", "HumanRendering"},
    "gymnasium.wrappers.stateful_reward": {"NormalizeReward"},
    "gymnasium.wrappers.vector.common": {"RecordEpisodeStatistics"},
    "gymnasium.wrappers.vector.rendering": {"RecordVideo", "HumanRendering"},
    "gymnasium.wrappers.vector.stateful_reward": {"NormalizeReward"},
}
_STEPS = (
    gymnasium.Wrapper.step,
    gymnasium.RewardWrapper.step,
    gymnasium.vector.VectorWrapper.step,
    gymnasium.vector.VectorRewardWrapper.step,
)


def transport_config(env: Any) -> TransportConfig:
    """Return the definition of a (wrapped) transport environment.

    Raises:
        CertificateError: it is another kind of environment.
    """
    for layer in wrappers(env):
        if isinstance(layer, _OBSERVATION_WRAPPERS):
            raise CertificateError(
                "env",
                layer,
                "an environment whose observations are as it made them",
                "Put observation wrappers around NuMaxActionScaling, not inside it.",
            )
    config = getattr(env.unwrapped, "config", None)
    if not isinstance(config, TransportConfig):
        raise CertificateError(
            "env", env, "a DeformTransport environment", "Certificates bound its task acceleration."
        )
    return config


def action_changers(env: Any) -> tuple[str, ...]:
    """Return the names of the wrappers of ``env`` that may change an action on its way.

    Those are all but Gymnasium's that do not, wrappers without a ``step`` of their own, and those
    that say so by an attribute ``keeps_actions`` that is true.
    """
    return tuple(type(layer).__name__ for layer in wrappers(env) if not _keeps_actions(layer))


def _keeps_actions(layer: Any) -> bool:
    kind = type(layer)
    if hasattr(kind, "keeps_actions"):
        return bool(layer.keeps_actions)
    if isinstance(layer, _ACTION_WRAPPERS):
        return False
    is_known = kind.__name__ in _KEEPING.get(kind.__module__, ())
    return is_known or kind.step in _STEPS


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
    if values is not None and values.shape == shape:
        values[~awake] = 0.0
    if values is None or values.shape != shape or not np.isfinite(values).all():
        raise ActionError("action", actions, f"finite numbers of shape {shape}", "Check them.")
    return values
