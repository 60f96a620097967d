"""Normalized actions scaled into a certificate, with a count of what was changed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.validation import require_params
from defmanip_gym.wrappers.applicability import Applicability, require_fit
from defmanip_gym.wrappers.certified_motion import CertifiedMotion, GraspMotion
from defmanip_gym.wrappers.transport import finite_actions

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Changes of a command below this (m/s²) are rounding.
ROUNDING_M_S2 = 1e-9


class ActionScaling:
    """Scales batches of normalized actions into a certificate and counts what it changed.

    Args:
        config: the environment's definition.
        certificate: the bounds to enforce.
        count: n.
        action_changers: wrappers between here and the environment that may change actions.

    Raises:
        CertificateError: the certificate does not fit the environment.
    """

    remembers = ("_motion", "_applicability", "steps", "interventions", "total_intervention_m_s2")

    def __init__(
        self,
        config: TransportConfig,
        certificate: Certificate,
        count: int = 1,
        action_changers: tuple[str, ...] = (),
    ) -> None:
        certificate = require_params("certificate", certificate, Certificate)
        require_fit(config, certificate)
        self._config = config
        self._layout = ObservationLayout(config.beam.segment_count)
        self._applicability = Applicability(config, certificate, count, action_changers)
        self._motion = CertifiedMotion(config, certificate, count)
        self.steps = 0
        self.interventions = 0
        self.total_intervention_m_s2 = 0.0

    @property
    def applies(self) -> BoolArray:
        """Whether the certificate covers the episodes as far as is known by now, (n,)."""
        return self._applicability.applies

    @property
    def reasons(self) -> NDArray[np.object_]:
        """Why it does not, in words, (n,); empty where it does."""
        return self._applicability.reasons

    def begin(self, observation: Array, started: BoolArray) -> None:
        """Forget the past of episodes that start.

        Args:
            observation: first observations, (n, size); rows that do not start are not looked at.
            started: which episodes start, (n,).
        """
        motion = GraspMotion.observed(self._layout, observation)
        self._motion.begin(started)
        self._applicability.begin(self._layout.part(observation, "swing"), motion, started)

    def scale(
        self, actions: Any, observation: Array, idle: BoolArray | None = None
    ) -> tuple[Array, Array]:
        """Return certified actions (n, 3) and by how much w changed, (n,) m/s².

        Args:
            actions: normalized, (n, 3).
            observation: what the environment last returned, (n, size).
            idle: episodes whose actions do not matter, (n,); none by default.

        Raises:
            ActionError: actions that are not finite or of another shape.
        """
        limit = self._config.task.max_acceleration_m_s2
        awake = np.ones(len(observation), dtype=bool) if idle is None else ~idle
        w = np.clip(finite_actions(actions, awake), -1.0, 1.0) * limit
        certified = self._motion.certified(w, GraspMotion.observed(self._layout, observation))
        change = np.where(awake, np.sqrt(((certified - w) ** 2).sum(axis=1)), 0.0)
        self.steps += int(awake.sum())
        self.interventions += int((change > ROUNDING_M_S2).sum())
        self.total_intervention_m_s2 += float(change.sum())
        return certified / limit, change

    def conclude(self, observation: Array, idle: BoolArray | None = None) -> None:
        """Compare the motion with what was commanded, and with what the certificate provides for.

        Args:
            observation: at the end of the period, before any reset, (n, size).
            idle: as for ``scale``.
        """
        motion = GraspMotion.observed(self._layout, observation)
        surprise = self._motion.conclude(motion)
        self._applicability.watch(surprise, motion, idle)

    @property
    def intervention_rate(self) -> float:
        """Share of steps whose action was changed."""
        return self.interventions / max(self.steps, 1)
