"""Whether a certificate's conditions hold in an environment, and why not, in words.

A certificate covers an object under conditions; an environment is a robot with errors, noise,
disturbances, and whatever a user put between wrapper and robot. What the configuration tells is
judged before the first step, what only the motion tells while it lasts.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import CertificateError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates.certificate import Certificate
from defmanip_gym.theory.certificates.error_budget import ErrorBudget
from defmanip_gym.wrappers.admissible_motions import arm_range
from defmanip_gym.wrappers.certified_motion import GraspMotion
from defmanip_gym.wrappers.realization import realization_errors

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_ROUNDING_RAD = 1e-9
# a Gaussian leaves six standard deviations once in 5e8 draws
_NOISE_BOUND = 6.0


def require_fit(config: TransportConfig, certificate: Certificate) -> None:
    """Raise CertificateError unless the certificate is for such an environment at all."""
    if config.control_mode != "task":
        raise CertificateError(
            "control_mode",
            config.control_mode,
            "'task'",
            "A certificate bounds the task acceleration; make the environment in task mode.",
        )
    if certificate.coordinate_count != config.beam.segment_count:
        raise CertificateError(
            "certificate.coordinate_count",
            certificate.coordinate_count,
            f"{config.beam.segment_count}, as in the environment",
            "Compute the certificate for the environment's beam.",
        )
    if certificate.sigma_rad > config.sigma_rad:
        raise CertificateError(
            "certificate.sigma_rad",
            certificate.sigma_rad,
            f"at most the environment's {config.sigma_rad:.6g}",
            "Certify with the environment's sigma_rad.",
        )


class Applicability:
    """Judges n episodes of an environment.

    Args:
        config: the environment's definition.
        certificate: that is enforced.
        count: n.
        action_changers: names of wrappers that may change the certified actions.

    Attributes:
        reasons: why the certificate does not cover the episodes, in words, (n,); empty where it
            does as far as is known by now.
    """

    remembers = ("words",)

    def __init__(
        self,
        config: TransportConfig,
        certificate: Certificate,
        count: int = 1,
        action_changers: tuple[str, ...] = (),
    ) -> None:
        self._config, self._certificate = config, certificate
        self._action_changers = action_changers
        self.reasons = np.full(count, "", dtype=object)

    @property
    def applies(self) -> BoolArray:
        """Whether the certificate covers the episodes as far as is known by now, (n,)."""
        return self.reasons == ""

    @property
    def words(self) -> list[str]:
        """The same as a list."""
        return list(self.reasons)

    @words.setter
    def words(self, words: list[str]) -> None:
        self.reasons = np.array(words, dtype=object)

    def begin(self, swing: Array, motion: GraspMotion, started: BoolArray) -> None:
        """Judge episodes at their start.

        Args:
            swing: as observed, (n, N) rad.
            motion: of the grasp.
            started: which episodes start, (n,).
        """
        self.reasons[started] = self.configuration_reason
        for i in np.flatnonzero(started & self.applies):
            self.reasons[i] = self._start_reason(np.abs(swing[i]).max(), motion.joints[i])

    def watch(self, surprise: Array, motion: GraspMotion, idle: BoolArray | None) -> None:
        """Judge a control period by what it brought, (n, 3) m/s² of surprise."""
        if not self.applies.any():
            return
        room = self._budget.needed(np.abs(surprise[:, 0]), np.abs(surprise[:, 2]), self._stray_m_s)
        lost = ~(room <= self._budget.room_m_s2)
        turning = np.abs(motion.yaw_rate) > self._certificate.conditions.yaw_rate_rad_s
        awake = np.ones_like(lost) if idle is None else ~idle
        for i in np.flatnonzero((lost | turning) & awake & self.applies):
            self.reasons[i] = (
                f"it turned at {motion.yaw_rate[i]:.3g} rad/s" + self._allowed_yaw_rate
                if turning[i]
                else f"in a control period errors took {room[i]:.3g} m/s²{self._allowed_errors}"
            )

    @cached_property
    def configuration_reason(self) -> str:
        """Why the certificate covers no episode of this environment; empty if it may."""
        config, certificate = self._config, self._certificate
        if not all(certificate.covers(beam) for beam in self._beams):
            return "it was not computed for the beams that are carried"
        if certificate.proof == "none":
            return f"the bound of method {certificate.method!r} is not proven"
        if self._action_changers:
            return f"{' and '.join(self._action_changers)} may change the certified actions"
        if self._start_noise_rad > certificate.conditions.initial_swing_rad:
            return f"the swing at the start is measured to within {self._start_noise_rad:.3g} rad"
        if certificate.proof == "linear":
            return "the bound is proven for the linearized beam only"
        try:
            errors = realization_errors(config, certificate)
        except CertificateError as error:
            return f"its errors are not known: {error}"
        if errors.yaw_rate_rad_s > certificate.conditions.yaw_rate_rad_s:
            return f"it may turn at {errors.yaw_rate_rad_s:.3g} rad/s" + self._allowed_yaw_rate
        if not errors.room_m_s2 <= self._budget.room_m_s2:
            return (
                f"robot, beam, periods and beliefs of this environment make errors of up to "
                f"{errors.room_m_s2:.3g} m/s²{self._allowed_errors}"
            )
        return ""

    def _start_reason(self, swing_rad: float, joints: Array) -> str:
        conditions, config = self._certificate.conditions, self._config
        noise = self._start_noise_rad
        if swing_rad + noise > conditions.initial_swing_rad + _ROUNDING_RAD:
            measured = f", measured to within {noise:.3g} rad" if noise else ""
            return (
                f"the beam started at {swing_rad:.3g} rad{measured}; the certificate provides for "
                f"{conditions.initial_swing_rad:.3g} rad"
            )
        lowest, highest = arm_range(config)
        if not (
            (lowest - _ROUNDING_RAD <= joints).all() and (joints <= highest + _ROUNDING_RAD).all()
        ):
            return (
                f"the arm started at ({joints[0]:.3g}, {joints[1]:.3g}) rad, beyond task.start and "
                "task.goal, between which the errors were bounded"
            )
        return ""

    @property
    def _beams(self) -> tuple[BeamParams, ...]:
        """The beams that may be carried: what a certificate covers are intervals, so ends tell."""
        return self._config.beam_ranges.extremes(self._config.beam)

    @cached_property
    def _budget(self) -> ErrorBudget:
        return ErrorBudget.of(
            self._certificate, self._beams, physics_period_s=self._config.task.physics_period_s
        )

    @property
    def _start_noise_rad(self) -> float:
        return _NOISE_BOUND * self._config.disturbance.swing_sensor_noise_rad

    @property
    def _stray_m_s(self) -> float:
        return realization_errors(self._config, self._certificate).stray_m_s

    @property
    def _allowed_errors(self) -> str:
        return f"; the certificate has room for {self._budget.room_m_s2:.3g} m/s²"

    @property
    def _allowed_yaw_rate(self) -> str:
        return f"; the certificate provides for {self._certificate.conditions.yaw_rate_rad_s:.3g}"
