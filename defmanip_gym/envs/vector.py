"""``DeformTransport-v0`` for n episodes at once: the engine's own face."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from defmanip_gym.disturbance_ranges import DisturbanceRanges
from defmanip_gym.envs.config import ConstraintMode, ControlMode, InnerLoopKind, TransportConfig
from defmanip_gym.envs.deform_transport import action_space, observation_space
from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.envs.episode_access import EpisodeAccess, frames_per_second
from defmanip_gym.envs.registration import MAX_EPISODE_STEPS
from defmanip_gym.envs.rendering.modes import IMAGE_MODES
from defmanip_gym.envs.rendering.renderer import TransportRenderer
from defmanip_gym.envs.rendering.stage import Image
from defmanip_gym.envs.rendering.view_params import HEIGHT, WIDTH, FreeCameraParams, ViewParams
from defmanip_gym.errors import StartError
from defmanip_gym.params import BeamParams, BeamRanges, DisturbanceParams, RobotParams
from defmanip_gym.payloads.choice import payload_of
from defmanip_gym.payloads.payload import Payload
from defmanip_gym.state_tree import fitted
from defmanip_gym.task_params import TaskParams
from defmanip_gym.validation import (
    MOST_WORKERS,
    require_choice,
    require_seeds,
    require_whole,
)

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

MOST_ENVS = 65_536


class DeformTransportVectorEnv(EpisodeAccess, gymnasium.vector.VectorEnv[Any, Any, Any]):
    """n episodes of :class:`~defmanip_gym.envs.deform_transport.DeformTransportEnv` in one batch.

    Everything but the arguments below is as documented there. In ``info`` every key holds an
    array over the episodes, valid for all of them (there are no masks ``_key``). Where an episode
    ends in ``SAME_STEP`` mode, ``info`` tells of its successor, whose ``cost`` is 0: what its last
    step cost is in ``final_info`` only, and ``final_info["episode_cost"]`` is the episode's sum. In
    the other modes the last step's own ``info`` has both.

    Args:
        num_envs: n.
        max_episode_steps: control periods until truncation.
        autoreset_mode: ``NEXT_STEP`` (default, as in Gymnasium's own) resets an ended episode in
            the following step, whose action it ignores; ``SAME_STEP`` resets it within the step and
            puts its last observation and info in ``info["final_obs"]`` and ``info["final_info"]``,
            marked by ``_final_obs`` and ``_final_info``; ``DISABLED`` leaves that to
            ``reset(options={"reset_mask": mask})``. Or their values, such as ``"SameStep"``.
        num_threads: physics threads, 0 for one per CPU.
        render_mode: as in the single environment; ``render`` returns a tuple of n images.
        width: as in the single environment, like all that follow.
        height: see there.
        camera_id: see there.
        camera_name: see there.
        default_camera_config: see there.
        control_mode: see there.
        inner_loop: see there.
        constraint_mode: see there.
        sigma_rad: see there.
        robot: see there.
        beam: see there.
        beam_ranges: see there; every episode of the batch draws its own beam.
        nominal_robot: see there.
        nominal_beam: see there.
        payload: see there.
        task: see there.
        disturbance: see there.
        disturbance_ranges: see there; every episode of the batch draws its own.
    """

    metadata: dict[str, Any] = {
        "render_modes": list(IMAGE_MODES),
        "render_fps": 50,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int = MAX_EPISODE_STEPS,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        num_threads: int = 0,
        render_mode: str | None = None,
        width: int = WIDTH,
        height: int = HEIGHT,
        camera_id: int | None = None,
        camera_name: str | None = None,
        default_camera_config: FreeCameraParams | Mapping[str, Any] | None = None,
        control_mode: ControlMode = "task",
        inner_loop: InnerLoopKind = "model",
        constraint_mode: ConstraintMode = "terminate",
        sigma_rad: float = math.pi / 6,
        robot: RobotParams = RobotParams(),
        beam: BeamParams = BeamParams(),
        beam_ranges: BeamRanges = BeamRanges(),
        nominal_robot: RobotParams | None = None,
        nominal_beam: BeamParams | None = None,
        payload: Payload | Mapping[str, Any] | None = None,
        task: TaskParams = TaskParams(),
        disturbance: DisturbanceParams = DisturbanceParams(),
        disturbance_ranges: DisturbanceRanges = DisturbanceRanges(),
    ) -> None:
        num_envs = require_whole("num_envs", num_envs, 1, MOST_ENVS)
        max_episode_steps = require_whole("max_episode_steps", max_episode_steps, 1)
        num_threads = require_whole("num_threads", num_threads, 0, MOST_WORKERS)
        if render_mode is not None:
            require_choice("render_mode", render_mode, IMAGE_MODES)
        view = ViewParams(
            width=width,
            height=height,
            camera_id=camera_id,
            camera_name=camera_name,
            default_camera_config=default_camera_config,
        )
        self.num_envs, self.render_mode = num_envs, render_mode
        self.width, self.height = view.width, view.height
        self.camera_id, self.camera_name = view.camera_id, view.camera_name
        self.max_episode_steps = max_episode_steps
        if not isinstance(autoreset_mode, AutoresetMode):
            require_choice("autoreset_mode", autoreset_mode, [mode.value for mode in AutoresetMode])
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.config = TransportConfig(
            control_mode=control_mode,
            inner_loop=inner_loop,
            constraint_mode=constraint_mode,
            sigma_rad=sigma_rad,
            robot=robot,
            payload=payload_of(
                payload, beam=beam, beam_ranges=beam_ranges, nominal_beam=nominal_beam
            ),
            nominal_robot=nominal_robot,
            task=task,
            disturbance=disturbance,
            disturbance_ranges=disturbance_ranges,
        )
        self.metadata = {
            **type(self).metadata,
            "render_fps": frames_per_second(self.config),
            "autoreset_mode": self.autoreset_mode,
        }
        self.engine = TransportEngine(
            self.config,
            num_envs,
            num_threads=num_threads,
            max_episode_steps=max_episode_steps,
        )
        self.single_observation_space = observation_space(self.engine)
        self.single_action_space = action_space(self.engine)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._ended = np.zeros(num_envs, dtype=bool)
        self._renderer = TransportRenderer(self.engine, view)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Start episodes: all, or those in ``options["reset_mask"]`` (n,) bool.

        Args:
            seed: episode i gets ``seed + i``; or a seed for each of the n.
            options: ``start`` as in the single environment, or (n, 6) of them; ``reset_mask``.

        Raises:
            StartError: bad options.
            SeedError: bad seeds.
            ResetNeeded: the first reset leaves episodes out.
        """
        if not isinstance(options, Mapping | None):
            raise StartError("options", options, "a dict or None", "Write {'start': ...}.")
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        ids = np.arange(self.num_envs) if mask is None else self._masked(mask)
        seeds = require_seeds(seed, self.num_envs)
        observation, info = self.engine.reset(ids, seeds=[seeds[i] for i in ids], options=options)
        self._ended[ids] = False
        self._keep_results()
        return observation, info

    def step(self, actions: Array) -> tuple[Array, Array, BoolArray, BoolArray, dict[str, Any]]:
        """Advance every episode by one control period."""
        if self.autoreset_mode is AutoresetMode.NEXT_STEP and self._ended.any():
            return self._step_after_reset(actions)
        scores = self.engine.step(actions)
        self._ended = scores.terminated | scores.truncated
        observation, info = scores.observations, self.engine.info
        if self.autoreset_mode is AutoresetMode.SAME_STEP and np.count_nonzero(self._ended):
            final = {
                "final_obs": observation,
                "_final_obs": self._ended,
                "final_info": info,
                "_final_info": self._ended.copy(),
            }
            observation, info = self.engine.reset(np.flatnonzero(self._ended))
            info |= final
            self._ended = np.zeros(self.num_envs, dtype=bool)
        self._keep_results()
        return observation, scores.rewards, scores.terminated, scores.truncated, info

    def get_state(self) -> dict[str, Any]:
        """Return all that the future of the n episodes depends on."""
        return super().get_state() | {"ended": self._ended.copy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from such a state, or all n episodes from that of a single environment.

        Raises:
            StateError: it is of other beam segments or another number of episodes.
        """
        of_one = {"ended": np.zeros(1, dtype=bool)}
        kept = of_one | dict(state) if isinstance(state, Mapping) else of_one
        ended = fitted("state['ended']", kept.pop("ended"), self._ended)
        super().set_state(kept)
        self._ended = ended
        self._keep_results()

    @property  # type: ignore[override]
    def np_random(self) -> tuple[np.random.Generator, ...]:
        """The generator of each episode; to be set with n of them."""
        return tuple(self.engine.generators)

    @np_random.setter  # type: ignore[override]
    def np_random(self, generators: Sequence[np.random.Generator]) -> None:
        self.engine.draw_from(generators)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The seed of each episode's generator; -1 of a user's own."""
        return self.engine.generators.seeds

    def _keep_results(self) -> None:
        """Keep what running episodes were told: a reset of some tells the others again."""
        if self.autoreset_mode is AutoresetMode.DISABLED:
            self.engine.detach()

    def _masked(self, mask: Any) -> NDArray[np.intp]:
        try:
            values = np.asarray(mask)
        except ValueError:
            values = np.empty(0)
        if values.shape != (self.num_envs,) or values.dtype != bool or not values.any():
            raise StartError(
                "reset_mask",
                mask,
                f"{self.num_envs} booleans, at least one of them True",
                "Mark the episodes to start.",
            )
        return np.flatnonzero(values)

    def _step_after_reset(
        self, actions: Array
    ) -> tuple[Array, Array, BoolArray, BoolArray, dict[str, Any]]:
        """Step the running episodes and start those that ended in the previous step."""
        fresh = self._ended
        scores = self.engine.step(actions, idle=fresh)
        observation, info = self.engine.reset(np.flatnonzero(fresh))
        terminated, truncated = scores.terminated & ~fresh, scores.truncated & ~fresh
        self._ended = terminated | truncated
        return observation, np.where(fresh, 0.0, scores.rewards), terminated, truncated, info

    def render(self) -> tuple[Image, ...] | None:
        """Return an image of each episode.

        Raises:
            RenderingError: the machine offers no OpenGL.
        """
        if self.render_mode is None:
            gymnasium.logger.warn("render() does nothing without a render_mode at construction.")
            return None
        return self._renderer.images(self.render_mode)

    def render_camera(
        self,
        camera: str | int,
        *,
        mode: str = "rgb_array",
        width: int | None = None,
        height: int | None = None,
    ) -> tuple[Image, ...]:
        """Return an image of each episode; see the single environment's method."""
        return self._renderer.images(mode, camera=camera, width=width, height=height)

    def close_extras(self, **kwargs: Any) -> None:
        """Free what drawing needs."""
        self._renderer.close()
