"""When a certificate covers an environment: room for its errors, starts, yaw rate."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.certificates.error_budget import ErrorBudget
from defmanip_gym.theory.filters.swing_estimate import NOISE_BOUND
from defmanip_gym.wrappers.admissible_motions import arm_range
from defmanip_gym.wrappers.realization import realization_errors

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_ROUNDING_RAD = 1e-9


class NuMaxTerms:
    """Under which terms a certificate's promise holds in an environment.

    Args:
        config: the environment's definition.
        certificate: that is enforced.
    """

    delay_periods = 0
    outside_reason = "the beam swings more than the certificate provides for"

    def __init__(self, config: TransportConfig, certificate: Certificate) -> None:
        self._config, self._certificate = config, certificate
        self._layout = ObservationLayout(config.beam.segment_count)
        self.method = certificate.method

    @cached_property
    def configuration_reason(self) -> str:
        """Why the certificate covers no episode of this environment; empty if it may.

        Raises:
            CertificateError: the search for errors would take too long.
        """
        conditions = self._certificate.conditions
        if self._start_noise_rad > conditions.initial_swing_rad:
            return f"the swing at the start is measured to within {self._start_noise_rad:.3g} rad"
        if self._certificate.proof == "linear":
            return "the bound is proven for the linearized beam only"
        errors = realization_errors(self._config, self._certificate)
        if errors.yaw_rate_rad_s > conditions.yaw_rate_rad_s:
            return f"it may turn at {errors.yaw_rate_rad_s:.3g} rad/s" + self._allowed_yaw_rate
        if not errors.room_m_s2 <= self._budget.room_m_s2:
            return (
                f"robot, beam, periods and beliefs of this environment make errors of up to "
                f"{errors.room_m_s2:.3g} m/s²{self._allowed_errors}"
            )
        return ""

    def start_reason(self, observation: Array, i: int) -> str:
        """Return why the start of episode i, in observations (n, size), is not provided for."""
        conditions, noise = self._certificate.conditions, self._start_noise_rad
        swing_rad = np.abs(self._layout.part(observation, "swing")[i]).max()
        joints = self._layout.part(observation, "joints")[i]
        if swing_rad + noise > conditions.initial_swing_rad + _ROUNDING_RAD:
            measured = f", measured to within {noise:.3g} rad" if noise else ""
            return (
                f"the beam started at {swing_rad:.3g} rad{measured}; the certificate provides for "
                f"{conditions.initial_swing_rad:.3g} rad"
            )
        lowest, highest = arm_range(self._config)
        if not (
            (lowest - _ROUNDING_RAD <= joints).all() and (joints <= highest + _ROUNDING_RAD).all()
        ):
            return (
                f"the arm started at ({joints[0]:.3g}, {joints[1]:.3g}) rad, beyond task.start and "
                "task.goal, between which the errors were bounded"
            )
        return ""

    def broken(
        self, surprise: Array, observation: Array, memory: Any
    ) -> tuple[BoolArray, Callable[[int], str]]:
        """Return where a period broke the terms, (n,), and what to say of an episode."""
        stray = realization_errors(self._config, self._certificate).stray_m_s
        room = self._budget.needed(np.abs(surprise[:, 0]), np.abs(surprise[:, 2]), stray)
        yaw_rate = self._layout.part(observation, "base_velocity")[:, 1]
        turning = np.abs(yaw_rate) > self._certificate.conditions.yaw_rate_rad_s

        def reason(i: int) -> str:
            if turning[i]:
                return f"it turned at {yaw_rate[i]:.3g} rad/s" + self._allowed_yaw_rate
            return f"in a control period errors took {room[i]:.3g} m/s²{self._allowed_errors}"

        return ~(room <= self._budget.room_m_s2) | turning, reason

    @cached_property
    def _budget(self) -> ErrorBudget:
        return ErrorBudget.of(
            self._certificate,
            self._config.beam_ranges.extremes(self._config.beam),
            physics_period_s=self._config.task.physics_period_s,
        )

    @property
    def _start_noise_rad(self) -> float:
        return NOISE_BOUND * self._config.largest_disturbance.swing_sensor_noise_rad

    @property
    def _allowed_errors(self) -> str:
        return f"; the certificate has room for {self._budget.room_m_s2:.3g} m/s²"

    @property
    def _allowed_yaw_rate(self) -> str:
        return f"; the certificate provides for {self._certificate.conditions.yaw_rate_rad_s:.3g}"
