"""ν_max as an action-scaling wrapper: no policy inside it can violate the certificate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ActionError, CertificateError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.theory.certificates import Certificate
from defmanip_gym.theory.certified_command import certified_command
from defmanip_gym.theory.frames import base_to_world
from defmanip_gym.theory.robot_model import JOINT_TO_PITCH, ArmKinematics
from defmanip_gym.validation import number_array, plain, require_params

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_OBSERVATION_WRAPPERS = (gymnasium.ObservationWrapper, gymnasium.vector.VectorObservationWrapper)

# Differences below this (m/s², rad) are rounding.
_ROUNDING = 1e-9


@dataclass(kw_only=True)
class _LastPeriod:
    """Motion and command one control period ago, n episodes; ``known`` is False at their start."""

    velocity: Array
    heading: Array
    command: Array
    known: BoolArray

    @staticmethod
    def at_rest(count: int) -> _LastPeriod:
        return _LastPeriod(
            velocity=np.zeros((count, 3)),
            heading=np.zeros(count),
            command=np.zeros((count, 3)),
            known=np.zeros(count, dtype=bool),
        )

    def disturbance(self, velocity: Array, heading: Array, period_s: float) -> Array:
        """Return by how much the acceleration exceeded its command, (n, 3) m/s², base frame."""
        before = base_to_world(self.velocity, self.heading - heading)
        excess = (velocity - before) / period_s - self.command
        return np.where(self.known[:, None], excess, 0.0)


class ActionScaling:
    """Scales batches of normalized actions into a certificate and counts what it changed.

    Args:
        config: the environment's definition.
        certificate: the bounds to enforce.

    Raises:
        CertificateError: the certificate does not fit the environment.
    """

    def __init__(self, config: TransportConfig, certificate: Certificate) -> None:
        certificate = require_params("certificate", certificate, Certificate)
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
        self._config, self._certificate = config, certificate
        # what a certificate covers is an interval of dampings, so the ends of a range tell
        beams = config.beam_ranges.extremes(config.beam)
        self._covers = all(certificate.covers(beam) for beam in beams)
        self._layout = ObservationLayout(config.beam.segment_count)
        self._kinematics = ArmKinematics(config.robot)
        self._memory: _LastPeriod
        self.steps = 0
        self.interventions = 0
        self.total_intervention_m_s2 = 0.0

    def begin(self, observation: Array, started: BoolArray) -> BoolArray:
        """Forget the past of episodes that start; return whether the certificate covers these.

        It does when it covers every beam that an episode may carry and the episode starts within
        its initial swing.

        Args:
            observation: first observations, (n, size); rows that do not start are not looked at.
            started: which episodes start, (n,).
        """
        if not hasattr(self, "_memory"):
            self._memory = _LastPeriod.at_rest(len(started))
        self._memory.known[started] = False
        swing = np.abs(self._layout.part(observation, "swing")).max(axis=1)
        limit = self._certificate.conditions.initial_swing_rad + _ROUNDING
        return np.asarray(self._covers & (swing <= limit))

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
        task, part = self._config.task, partial(self._layout.part, observation)
        awake = np.ones(len(observation), dtype=bool) if idle is None else ~idle
        actions = finite_actions(actions, awake)
        velocity = part("grasp_velocity_b")
        heading = np.arctan2(part("heading")[:, 0], part("heading")[:, 1])
        w = np.clip(actions, -1.0, 1.0) * task.max_acceleration_m_s2
        certified = certified_command(
            w,
            velocity,
            part("base_velocity"),
            self._kinematics.reach_and_height(part("joints") @ JOINT_TO_PITCH.T)[:, 0],
            self._certificate,
            disturbance=self._memory.disturbance(velocity, heading, task.control_period_s),
            max_speed=task.max_speed_m_s,
            period_s=task.control_period_s,
        )
        limit = task.max_acceleration_m_s2
        certified = np.clip(certified, -limit, limit)
        self._memory = _LastPeriod(
            velocity=velocity.copy(),
            heading=heading,
            command=certified,
            known=np.ones(len(certified), dtype=bool),
        )
        change = np.where(awake, np.sqrt(((certified - w) ** 2).sum(axis=1)), 0.0)
        self.steps += int(awake.sum())
        self.interventions += int((change > _ROUNDING).sum())
        self.total_intervention_m_s2 += float(change.sum())
        return certified / limit, change

    @property
    def intervention_rate(self) -> float:
        """Share of steps whose action was changed."""
        return self.interventions / max(self.steps, 1)


class NuMaxActionScaling(
    gymnasium.Wrapper[Array, Array, Array, Array], gymnasium.utils.RecordConstructorArgs
):
    """Keeps every action of a single environment within a certificate.

    ``info`` gains ``intervened`` (bool), ``intervention_m_s2`` (change of w) and
    ``certificate_applies`` (whether the certificate covers every beam that episodes may carry, and
    this episode's start);
    ``scaling`` holds the running counts.

    Args:
        env: a DeformTransport environment in task mode.
        certificate: the bounds to enforce; or a mapping of its fields, as the JSON of a
            specification holds it.

    Raises:
        CertificateError: the certificate does not fit the environment.
    """

    def __init__(self, env: gymnasium.Env[Array, Array], certificate: Certificate) -> None:
        gymnasium.utils.RecordConstructorArgs.__init__(self, certificate=plain(certificate))
        super().__init__(env)
        self.scaling = ActionScaling(transport_config(env), certificate)
        self._observation: Array | None = None
        self._applies = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._observation = observation.copy()  # the caller's own from now on
        self._applies = bool(self.scaling.begin(observation[None], np.array([True]))[0])
        return observation, info | self._report(0.0)

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Step with the action scaled into the certificate."""
        if self._observation is None:
            raise ResetNeeded("Call reset() before the first step().")
        certified, change = self.scaling.scale([action], self._observation[None])
        observation, reward, terminated, truncated, info = self.env.step(certified[0])
        self._observation = observation.copy()  # the caller's own from now on
        return observation, float(reward), terminated, truncated, info | self._report(change[0])

    def _report(self, change: float) -> dict[str, Any]:
        return {
            "intervened": bool(change > _ROUNDING),
            "intervention_m_s2": float(change),
            "certificate_applies": self._applies,
        }


class NuMaxVectorActionScaling(gymnasium.vector.VectorWrapper[Any, Any, Any, Any, Any]):
    """The same for a batch; every added info key holds an array over the episodes.

    Args:
        env: a batched DeformTransport environment in task mode.
        certificate: the bounds to enforce.

    Raises:
        CertificateError: the certificate does not fit the environment.
    """

    def __init__(
        self, env: gymnasium.vector.VectorEnv[Any, Any, Any], certificate: Certificate
    ) -> None:
        super().__init__(env)
        self.scaling = ActionScaling(transport_config(env), certificate)
        self._observation: Array | None = None
        self._applies = np.zeros(env.num_envs, dtype=bool)
        self._ended = np.zeros(env.num_envs, dtype=bool)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Start episodes; all, or those of ``options["reset_mask"]``."""
        observation, info = self.env.reset(seed=seed, options=options)  # type: ignore[arg-type]
        mask = (options or {}).get("reset_mask")
        started = np.ones(self.num_envs, dtype=bool) if mask is None else np.asarray(mask)
        self._ended = self._ended & ~started
        self._remember(observation, started)
        return observation, info | self._report(np.zeros(self.num_envs))

    def step(
        self, actions: Array
    ) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Step with the actions scaled into the certificate."""
        if self._observation is None:
            raise ResetNeeded("Call reset() before the first step().")
        mode = self.env.metadata["autoreset_mode"]
        idle = self._ended if mode is AutoresetMode.NEXT_STEP else None
        certified, change = self.scaling.scale(actions, self._observation, idle)
        observation, reward, terminated, truncated, info = self.env.step(certified)
        report = self._report(change)
        if "final_info" in info:
            info["final_info"] |= report
        ended = terminated | truncated
        if mode is AutoresetMode.NEXT_STEP:
            started, self._ended = self._ended, ended
        else:
            started = ended if mode is AutoresetMode.SAME_STEP else np.zeros_like(ended)
        self._remember(observation, started)
        return observation, reward, terminated, truncated, info | self._report(change)

    def _remember(self, observation: Array, started: NDArray[np.bool_]) -> None:
        self._observation = observation.copy()  # the caller's own from now on
        self._applies = np.where(started, self.scaling.begin(observation, started), self._applies)

    def _report(self, change: Array) -> dict[str, Any]:
        return {
            "intervened": change > _ROUNDING,
            "intervention_m_s2": change,
            "certificate_applies": self._applies.copy(),
        }


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


def transport_config(env: Any) -> TransportConfig:
    """Return the definition of a (wrapped) transport environment.

    Raises:
        CertificateError: it is another kind of environment.
    """
    layer = env
    while layer is not env.unwrapped:
        if isinstance(layer, _OBSERVATION_WRAPPERS):
            raise CertificateError(
                "env",
                layer,
                "an environment whose observations are as it made them",
                "Put observation wrappers around NuMaxActionScaling, not inside it.",
            )
        layer = layer.env
    config = getattr(env.unwrapped, "config", None)
    if not isinstance(config, TransportConfig):
        raise CertificateError(
            "env", env, "a DeformTransport environment", "Certificates bound its task acceleration."
        )
    return config
