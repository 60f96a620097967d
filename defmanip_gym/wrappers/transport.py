"""What wrappers need to know of the transport environment that they wrap."""

from __future__ import annotations

from typing import Any

import gymnasium

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.state import wrappers
from defmanip_gym.errors import CertificateError
from defmanip_gym.wrappers.action_delay import ActionDelay

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
                "Put observation wrappers around the safety filter, not inside it.",
            )
    config = getattr(env.unwrapped, "config", None)
    if not isinstance(config, TransportConfig):
        raise CertificateError(
            "env", env, "a DeformTransport environment", "Certificates bound its task acceleration."
        )
    return config


def action_changers(env: Any) -> tuple[str, ...]:
    """Return the names of the wrappers of ``env`` that may change an action on its way.

    Those are all but Gymnasium's that do not, wrappers without a ``step`` of their own, those that
    say so by an attribute ``keeps_actions`` that is true, and ``ActionDelay`` with one delay for
    all episodes, which filters know.
    """
    return tuple(
        type(layer).__name__
        for layer in wrappers(env)
        if not (_keeps_actions(layer) or (isinstance(layer, ActionDelay) and not layer.is_drawn))
    )


def delay_periods(env: Any) -> int:
    """Return by how many control periods, at most, wrappers of ``env`` hold actions back."""
    return sum(layer.periods for layer in wrappers(env) if isinstance(layer, ActionDelay))


def known_delay_periods(env: Any) -> int:
    """Return by how many control periods wrappers hold actions back in every episode.

    That is what a filter can foresee through; of delays that episodes draw nothing is known to it.
    """
    delays = [layer for layer in wrappers(env) if isinstance(layer, ActionDelay)]
    return sum(layer.periods for layer in delays if not layer.is_drawn)


def _keeps_actions(layer: Any) -> bool:
    kind = type(layer)
    if hasattr(kind, "keeps_actions"):
        return bool(layer.keeps_actions)
    if isinstance(layer, _ACTION_WRAPPERS):
        return False
    is_known = kind.__name__ in _KEEPING.get(kind.__module__, ())
    return is_known or kind.step in _STEPS
