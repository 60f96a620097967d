"""The single environment ``DeformTransport-v0``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import gymnasium
import mujoco
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from defmanip_gym.disturbance_ranges import DisturbanceRanges
from defmanip_gym.envs.config import ConstraintMode, ControlMode, InnerLoopKind, TransportConfig
from defmanip_gym.envs.engine import TransportEngine
from defmanip_gym.envs.episode_access import EpisodeAccess, frames_per_second
from defmanip_gym.envs.rendering.modes import RENDER_MODES, RenderModes
from defmanip_gym.envs.rendering.renderer import TransportRenderer
from defmanip_gym.envs.rendering.stage import Image
from defmanip_gym.envs.rendering.view_params import HEIGHT, WIDTH, FreeCameraParams, ViewParams
from defmanip_gym.params import BeamParams, BeamRanges, DisturbanceParams, RobotParams
from defmanip_gym.payloads.choice import payload_of
from defmanip_gym.payloads.payload import Payload
from defmanip_gym.task_params import TaskParams
from defmanip_gym.validation import require_choice, require_seed

Array = NDArray[np.float64]


class DeformTransportEnv(EpisodeAccess, gymnasium.Env[Any, Any]):
    """Carry a swinging or flexible beam to a goal without deforming it past σ.

    ## Description
    A nonholonomic mobile manipulator (a unicycle base with a two-joint arm) holds a beam by its
    upper end. It must bring the grasp point to the goal, with the right heading, and come to rest
    there, while the swing of every beam segment from the vertical stays within ±σ: the
    simulation of H. G. Tanner, "Mobile Manipulation of Flexible Objects Under Deformation
    Constraints", as a reinforcement learning task. Physics run in MuJoCo at 5 ms, control at 20 ms.
    Vectors marked `_b` are in the base frame: forward along the heading, left, up.

    ## Action Space
    `control_mode="task"` (default): `Box(-1, 1, (3,), float64)`. The acceleration w of the grasp
    point, Eq. (29), over `task.max_acceleration_m_s2` (3 m/s²). A built-in feedback linearization
    with nominal parameters, Eq. (28), turns it into forces; a limiter keeps the grasp below
    `task.max_speed_m_s` (2 m/s, to within 3 % as the beam swings) and never hinders braking.
    `inner_loop="measured_force"` has no model of the beam, but the grasp force as last observed,
    sensor noise included, Eqs. (2), (3). It changes only what is between w and forces.

    | Num | Action                          | Min | Max | Unit    |
    | --- | ------------------------------- | --- | --- | ------- |
    | 0   | forward acceleration of grasp   | -1  | 1   | 3 m/s²  |
    | 1   | leftward acceleration of grasp  | -1  | 1   | 3 m/s²  |
    | 2   | upward acceleration of grasp    | -1  | 1   | 3 m/s²  |

    `control_mode="force"`: `Box(-1, 1, (4,), float64)`, the generalized forces T_r of Eq. (2) over
    the actuator limits in `robot`.

    | Num | Action                       | Min | Max | Unit    |
    | --- | ---------------------------- | --- | --- | ------- |
    | 0   | drive force f_b              | -1  | 1   | 400 N   |
    | 1   | steering torque α_b          | -1  | 1   | 120 N·m |
    | 2   | shoulder torque τ1           | -1  | 1   | 250 N·m |
    | 3   | elbow torque τ2              | -1  | 1   | 150 N·m |

    ## Observation Space
    `Box(-inf, inf, (20 + 2 N,), float64)` for a beam of N segments; shown for N = 1.

    | Num   | Name             | Observation                            | Unit       |
    | ----- | ---------------- | -------------------------------------- | ---------- |
    | 0-2   | goal_offset_b    | goal minus grasp position              | m          |
    | 3-4   | heading          | sine and cosine of θ − θ_goal          | -          |
    | 5-7   | grasp_velocity_b | velocity of the grasp                  | m/s        |
    | 8-9   | base_velocity    | u1, u2                                 | m/s, rad/s |
    | 10-11 | joints           | q1, q2                                 | rad        |
    | 12-13 | joint_rates      | q̇1, q̇2                                 | rad/s      |
    | 14    | swing            | φ of each segment, from the vertical   | rad        |
    | 15    | swing_rate       | φ̇ of each segment                      | rad/s      |
    | 16-18 | grasp_force_b    | measured force on the object           | N          |
    | 19-21 | near_offset_b    | tanh of goal_offset_b over 0.5 m       | -          |

    Of a `payload` from a file, swing and swing_rate are its joint positions and rates, rad or m; φ
    and σ in what follows then stand for these, and `info` has no `beam_` entries.

    ## Rewards
    The sum of the terms below, each also in `info`; the first four are differences of potentials.
    d is the planar plus the vertical distance of the grasp to the goal, ψ the angle between the
    heading and the dipole streamline (Section VI) through the grasp, blended into the heading
    error at the goal, and e the Euclidean norm of the success errors, each over its tolerance.
    In e, speed and swing count as far as they exceed what fits the distance left to the goal: 1 m/s
    and 0.5 rad for each metre (`approach_speed_per_m`, `approach_swing_rad_per_m`).

    | Term               | Value (weights in `task.reward`)                                       |
    | ------------------ | ---------------------------------------------------------------------- |
    | reward_distance    | decrease of d, 1 per metre                                             |
    | reward_course      | decrease of ψ, 10 per radian                                           |
    | reward_closeness   | decrease of log(1 + e), times 5                                        |
    | reward_time_to_go  | decrease of T̂, times 0 in v0                                           |
    | reward_time        | -0.02 a step                                                           |
    | reward_effort      | -0.001 times the squared norm of the action                            |
    | reward_success     | +10 on success                                                         |
    | reward_failure     | -10 on leaving the workspace, on failed physics, and in                |
    |                    | `constraint_mode="terminate"` on exceeding σ                           |
    | reward_deformation | in `constraint_mode="penalty"`: -(‖z2‖∞/σ - 1) while σ is exceeded     |

    In v1 the first three weights and the time's are 0, reward_time_to_go is 10 times the decrease
    of T̂ in s, and failure costs 20. T̂ is how long it takes to come to rest at the goal, estimated
    from position, heading, their rates and the swing (docs/derivations.md, section 25).

    Every step's `info` also holds `is_success` and, in every mode, `cost` (1.0 while ‖z2‖∞ > σ,
    else 0.0), `episode_cost` (its sum over the steps of the episode so far), `constraint_margin`
    (σ − ‖z2‖∞, rad), `cost_speed` (grasp speed beyond the limit, m/s), `left_workspace`,
    `simulation_failed`, `distance_to_goal` (m), and what the true beam of this episode is:
    `beam_damping` (N·m·s/rad), `beam_mass_kg` and `beam_length_m`.

    ## Starting State
    At rest, uniformly within ±(1.5 m, 1.5 m, 0.5 rad, 0.1 rad, 0.1 rad, 0.05 rad) of the paper's
    (x, y, θ, q1, q2, φ) = (-8.5, 5.5, 0, π/3, -π/2, 0), or, by `task.start.distance_m`, on a ring.
    `reset(options={"start": "paper"})` starts right there, and `{"start": (x, y, θ, q1, q2, φ)}`
    anywhere in the workspace. With `beam_ranges`, as in `BeamRanges(damping=(0.05, 1.0))`, each
    episode draws its own beam, by `disturbance_ranges` its own disturbance.

    ## Episode End
    Termination: success (grasp within 5 cm of the goal, slower than 5 cm/s, |φ| < 0.05 rad, heading
    within 0.2 rad), leaving the workspace (more than 20 m from the goal, elbow straight or folded,
    grasp too close to the shoulder axis or the floor), failed physics, and in
    `constraint_mode="terminate"` ‖z2‖∞ > σ. Truncation: 1,000 steps (20 s) by `gymnasium.make`.

    ## Arguments
    | Argument        | Default          | Meaning                                                |
    | --------------- | ---------------- | ------------------------------------------------------ |
    | render_mode     | `None`           | `"human"`, `"rgb_array"` or `"depth_array"`            |
    | width           | 640              | of images, pixels                                      |
    | height          | 480              | the same                                               |
    | camera_id       | `None`           | number of a camera of the model, -1 for the free one   |
    | camera_name     | `None`, `"track"` | `"track"`, `"side"`, `"top"`, `"grasp"`, `"overview"` |
    | default_camera_config | `None`     | free camera: `FreeCameraParams` or their mapping       |
    | control_mode    | `"task"`         | `"task"` or `"force"`                                  |
    | inner_loop      | `"model"`        | `"model"` or `"measured_force"`                        |
    | constraint_mode | `"terminate"`    | `"terminate"`, `"penalty"` or `"cost"`                 |
    | sigma_rad       | π/6              | σ, admissible swing, between 0 and π/3                 |
    | robot           | `RobotParams()`  | true robot                                             |
    | beam            | `BeamParams()`   | true beam                                              |
    | beam_ranges     | none (`BeamRanges()`) | damping, mass, length to draw each episode from   |
    | nominal_robot   | `None`           | robot of the feedback linearization; the true one      |
    | nominal_beam    | `None`           | its beam; `beam` with no damping at the root           |
    | payload         | `None`           | what is carried instead of a beam: `MjcfPayload(...)`  |
    | task            | `TaskParams()`   | goal, starts, limits, tolerances, rewards              |
    | disturbance     | none (`DisturbanceParams()`) | force sinusoid, bias, sensor noise         |
    | disturbance_ranges | none (`DisturbanceRanges()`) | of these, to draw each episode from |

    Parameters may also be mappings of their fields, as the JSON of `env.spec` holds them.

    ## Version History
    * v1: the inner loop `"measured_force"`, and the time to the goal as reward, by which quicker
      is better at once: arguments `inner_loop` and `task.reward`. Another `task` brings v0's
      reward back, unless it has its own. `DeformTransportRandomized-v1` also draws beams (damping
      ×0.1 to ×10, mass ×0.5 to ×2, length ±20 %), disturbances and starts 0.5 to 18 m away.
    * v0: initial version.
    """

    metadata: dict[str, Any] = {"render_modes": RenderModes(RENDER_MODES), "render_fps": 50}

    def __init__(
        self,
        *,
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
        if render_mode is not None:
            require_choice("render_mode", render_mode, RENDER_MODES)
        view = ViewParams(
            width=width,
            height=height,
            camera_id=camera_id,
            camera_name=camera_name,
            default_camera_config=default_camera_config,
        )
        self.render_mode = render_mode
        self.width, self.height, self.camera_id = view.width, view.height, view.camera_id
        self.camera_name = view.camera_name
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
        self.metadata = {**type(self).metadata, "render_fps": frames_per_second(self.config)}
        self.engine = TransportEngine(self.config, num_envs=1)
        self.observation_space = observation_space(self.engine)
        self.action_space = action_space(self.engine)
        self._renderer = TransportRenderer(self.engine, view)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode; see "Starting State" for ``options``.

        Raises:
            StartError: a start that cannot be taken.
            SeedError: a seed that is not a whole number >= 0.
        """
        observation, _ = self.engine.reset(seeds=[require_seed(seed)], options=options)
        if self.render_mode == "human":
            self.render()
        return observation[0], self.engine.single_info

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Advance one control period (20 ms).

        Raises:
            ActionError: wrong shape or values that are not finite.
        """
        scores = self.engine.step([action])
        if self.render_mode == "human":
            self.render()
        return (
            scores.observations[0],
            scores.rewards.item(),
            scores.terminated.item(),
            False,
            self.engine.single_info,
        )

    @property
    def data(self) -> mujoco.MjData:
        """MuJoCo's data of the episode as it is now: a copy, with all derived fields."""
        return self.get_data()

    # Gymnasium's property np_random reads and sets these
    @property
    def _np_random(self) -> np.random.Generator:
        return self.engine.generators[0]

    @_np_random.setter
    def _np_random(self, generator: np.random.Generator) -> None:
        self.engine.draw_from([generator])

    @property
    def _np_random_seed(self) -> int:
        return self.engine.generators.seeds[0]

    @_np_random_seed.setter
    def _np_random_seed(self, seed: int) -> None:
        """Gymnasium notes -1 with a generator of the user's, as is done with the generator."""

    def render(self) -> Any:
        """Return an image, (height, width, 3) uint8 or depth (height, width) float32, or show it.

        Raises:
            RenderingError: the machine offers no OpenGL, or no display for a window.
        """
        if self.render_mode is None:
            gymnasium.logger.warn("render() does nothing without a render_mode at construction.")
            return None
        return self._renderer.render(self.render_mode)

    def render_camera(
        self,
        camera: str | int,
        *,
        mode: str = "rgb_array",
        width: int | None = None,
        height: int | None = None,
    ) -> Image:
        """Return an image of another camera, size or kind than ``render``'s; any ``render_mode``.

        Args:
            camera: name or number of a camera of the model, -1 for the free one.
            mode: ``"rgb_array"`` or ``"depth_array"``.
            width: pixels; the environment's by default.
            height: the same.

        Raises:
            ParameterError: an unknown camera or mode, or a size outside its range.
            RenderingError: the machine offers no OpenGL.
        """
        return self._renderer.images(mode, camera=camera, width=width, height=height)[0]

    def close(self) -> None:
        """Free what drawing needs."""
        self._renderer.close()


def observation_space(engine: TransportEngine) -> spaces.Box:
    """Return the observation space of one episode."""
    return spaces.Box(-np.inf, np.inf, (engine.layout.size,), np.float64)


def action_space(engine: TransportEngine) -> spaces.Box:
    """Return the action space of one episode."""
    return spaces.Box(-1.0, 1.0, (engine.action_size,), np.float64)
