"""The one engine: n episodes of the transport task, stepped together.

Both Gymnasium faces (``deform_transport`` for one, ``vector`` for n) are thin layers over it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from defmanip_gym.compiled import machine_code, without_garbage_collection
from defmanip_gym.envs.carrying import require_carriable
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.disturbance import EpisodeDisturbances
from defmanip_gym.envs.generators import EpisodeGenerators
from defmanip_gym.envs.inner_loop import InnerLoop
from defmanip_gym.envs.scores import FLAGS, MEASURES, Scores, score
from defmanip_gym.envs.sensor_noise import SensorNoise
from defmanip_gym.envs.starts import StartSampler, check_starts, extreme_starts, requested_starts
from defmanip_gym.envs.survey import goal_of
from defmanip_gym.envs.task import task_of
from defmanip_gym.envs.workspace import workspace_of
from defmanip_gym.errors import StateError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.plant.plant_state import PlantState
from defmanip_gym.plant.simulation import Simulation
from defmanip_gym.state_tree import fitted

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Ids = NDArray[np.intp]


class TransportEngine:
    """Physics, inner control loop, observation, reward and episode ends for n episodes.

    Args:
        config: the environment's definition.
        num_envs: n.
        num_threads: physics threads, 0 for one per CPU.
        max_episode_steps: control periods until truncation; never by default.
    """

    @without_garbage_collection()
    def __init__(
        self,
        config: TransportConfig,
        num_envs: int,
        *,
        num_threads: int = 0,
        max_episode_steps: int | None = None,
    ) -> None:
        check_starts(extreme_starts(config.task.start, config.task.goal), config)
        require_carriable(config)
        self.config, self.num_envs = config, num_envs
        self.layout = ObservationLayout(config.payload.count)
        self._task, self._goal = task_of(config), goal_of(config)
        self._workspace = workspace_of(config)
        self.simulation = Simulation(
            config.robot,
            config.payload.body(),
            count=num_envs,
            goal_position_m=config.goal_position_m,
            physics_period_s=config.task.physics_period_s,
            num_threads=num_threads,
        )
        self._inner_loop = InnerLoop(config, self.simulation.generalized_forces)
        self.action_size = self._inner_loop.action_size
        self.generators = EpisodeGenerators(num_envs)
        self._starts = StartSampler(config.task.start, self.generators, config.task.goal)
        self._disturbances = EpisodeDisturbances(config, self.generators)
        self._noise = SensorNoise(self._disturbances, self.layout, self.generators)
        self._all = np.arange(num_envs)
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._last_step = max_episode_steps or int(np.iinfo(np.int64).max)
        self._cargo = config.payload.cargo(self.simulation, self.generators)
        self._info_keys = (*FLAGS, *MEASURES, "episode_cost", *self._cargo.told)
        self._is_started = False
        self._at_rest = np.zeros((num_envs, self.action_size)), np.zeros(num_envs, dtype=np.bool_)
        self._scores = Scores.empty(num_envs, self.layout.size)
        self._plant = PlantState.empty(num_envs, config.payload.count)
        self._plant_before = self._plant.copy()
        self._score = machine_code(
            score,
            self._task,
            self._goal,
            self._workspace,
            self._plant,
            self._all,
            *self._at_rest,
            self._steps,
            self._last_step,
            self._scores,
            self._scores,
        )

    @property
    def steps(self) -> NDArray[np.int64]:
        """Control periods since the start of each episode, (n,)."""
        return self._steps

    def count_from(self, steps: NDArray[np.int64]) -> None:
        """Take the running episodes for ones with (n,) control periods behind them."""
        self._steps[:] = np.maximum(steps, self._steps)

    @property
    def plant_state(self) -> PlantState:
        """The true state, for evaluation and drawing; controllers see observations only.

        Raises:
            ResetNeeded: no episode has been started.
        """
        self._require_start()
        return self._plant.copy()

    @property
    def largest_swing_rad(self) -> Array:
        """‖z2‖∞ of each episode, (n,)."""
        largest: Array = np.abs(self.plant_state.swing).max(axis=1)
        return largest

    @property
    def info(self) -> dict[str, Any]:
        """What the last step or reset tells beside observation and reward, by name, (n,) each."""
        scores = self._scores
        # a copy: the next step adds to it
        costs = (scores.episode_costs.copy(),)
        values = chain(scores.told_flags, scores.measures, costs, self._cargo.values.copy())
        return dict(zip(self._info_keys, values, strict=True))

    @property
    def single_info(self) -> dict[str, Any]:
        """The same as plain numbers of the only episode."""
        scores = self._scores
        values = (
            *scores.told_flags[:, 0].tolist(),
            *scores.measures[:, 0].tolist(),
            scores.episode_costs.item(),
            *self._cargo.values[:, 0].tolist(),
        )
        return dict(zip(self._info_keys, values, strict=True))

    def reset(
        self,
        ids: Ids | None = None,
        *,
        seeds: Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Start new episodes and return observation and info of all n.

        What the episodes that go on reported in their last step is returned again.

        Args:
            ids: which episodes; all by default.
            seeds: a seed for each of them; ``None`` goes on with its generator.
            options: ``{"start": "sampled" | "paper" | six numbers | (n, 6) numbers}``.

        Raises:
            StartError: the requested start cannot be taken.
            SeedError: a seed that is none.
            ResetNeeded: the first reset leaves episodes out.
            In all of these cases the running episodes go on as if nothing had been asked.
        """
        ids = self._all if ids is None else ids
        if not self._is_started and len(ids) < self.num_envs:
            raise ResetNeeded("The first reset must start every episode.")
        requested = requested_starts(options, self.num_envs)
        if requested is not None:
            check_starts(requested[ids], self.config)
        if seeds is not None:
            self._forget(self.generators.seed(ids.tolist(), seeds))
        starts = self._starts.sample(ids) if requested is None else requested[ids]
        self._cargo.draw(ids)
        self._disturbances.draw(ids)
        self._place(ids, starts)
        self._steps[ids] = 0
        self._is_started = True
        self.simulation.read_into(self._plant, ids)
        self._scores = self._scores.copy()
        self._fill_scores(ids, *self._at_rest, before=self._scores)
        self._noise.restart(ids)
        self._noise.add(self._scores.observations, ids)
        self._inner_loop.begin(ids, self._observed_force_b, self._plant.swing)
        return self._scores.observations, self.info

    def draw_from(self, generators: Sequence[np.random.Generator]) -> None:
        """Let the randomness of each episode come from a user's generator from now on.

        Raises:
            SeedError: no generators, or another number of them.
        """
        self.generators.replace(generators)
        self._forget(range(self.num_envs))

    def get_state(self) -> dict[str, Any]:
        """Return all that the future of the episodes depends on, arrays (n, ...)."""
        scores = self._scores
        return {
            "is_started": self._is_started,
            "steps": self._steps.copy(),
            "generators": self.generators.get_state(),
            "starts": self._starts.get_state(),
            "noise": self._noise.get_state(),
            "beams": self._cargo.get_state(),
            "disturbances": self._disturbances.get_state(),
            "simulation": self.simulation.get_state(),
            "plant": self._plant.copy()._asdict(),
            "inner_loop": self._inner_loop.get_state(self._plant),
            "observations": scores.observations.copy(),
            "flags": scores.flags.T.copy(),
            "numbers": scores.numbers.T.copy(),
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Go on from what ``get_state`` returned; of one episode, let all go on from it.

        Raises:
            StateError: it does not fit; then nothing has changed.
        """
        checked_by_themselves = dict.fromkeys(("beams", "disturbances", "noise", "starts"))
        own = self.get_state() | checked_by_themselves
        state = fitted("state", state, own)
        if not isinstance(state["is_started"], bool):
            raise StateError("state['is_started']", state["is_started"], "a bool", "See get_state.")
        starts = self._starts.fitting(state["starts"])
        cargo, noise = self._cargo.fitting(state["beams"]), self._noise.fitting(state["noise"])
        disturbances = self._disturbances.fitting(state["disturbances"])
        self.generators.set_state(state["generators"])
        self._cargo.set_state(cargo)
        self._disturbances.set_state(disturbances)
        self._starts.set_state(starts)
        self._noise.set_state(noise)
        self.simulation.set_state(state["simulation"])
        self._plant = PlantState(**state["plant"])
        self._scores = Scores(
            state["observations"],
            np.ascontiguousarray(state["flags"].T),
            np.ascontiguousarray(state["numbers"].T),
        )
        self._inner_loop.set_state(state["inner_loop"])
        self._steps = state["steps"]
        self._is_started = state["is_started"]

    def detach(self) -> None:
        """Go on with a copy of the last results, whatever becomes of those handed out."""
        self._scores = self._scores.copy()

    def step(self, actions: Any, *, idle: BoolArray | None = None) -> Scores:
        """Advance all episodes by one control period.

        Args:
            actions: (n, 3) task accelerations over ``max_acceleration_m_s2`` in the base frame,
                or (n, 4) forces over the actuator limits; values beyond ±1 are clipped.
            idle: episodes that have ended and only go along, (n,); their actions do not matter.

        Raises:
            ActionError: wrong shape or values that are not finite.
            ResetNeeded: no episode has been started.
        """
        self._require_start()
        forces = self.simulation.generalized_forces
        actions = self._inner_loop.write_forces(actions, self._plant, forces, idle=idle)
        before = self._scores
        if self._disturbances.has_force:
            self.simulation.push_grasp(self._disturbances.force(self._steps))
        failed = self.simulation.step(self.config.task.substeps)
        self._steps += 1
        self._plant, self._plant_before = self._plant_before, self._plant
        self.simulation.read_into(self._plant, self._all)
        if np.count_nonzero(failed):
            self._plant.freeze(failed, self._plant_before)
        self._scores = Scores.empty(self.num_envs, self.layout.size)
        self._fill_scores(self._all, actions, failed, before=before)
        awake = self._all if idle is None else np.flatnonzero(~idle)
        self._noise.add(self._scores.observations, awake)
        if self._inner_loop.feels:
            self._inner_loop.feel(self._plant_before, self._plant, self._observed_force_b)
        return self._scores

    def _fill_scores(self, ids: Ids, actions: Array, failed: BoolArray, *, before: Scores) -> None:
        self._score(
            self._task,
            self._goal,
            self._workspace,
            self._plant,
            ids,
            actions,
            failed,
            self._steps,
            self._last_step,
            before,
            self._scores,
        )

    @property
    def _observed_force_b(self) -> Array:
        return self.layout.part(self._scores.observations, "grasp_force_b")

    def _require_start(self) -> None:
        if not self._is_started:
            raise ResetNeeded("Call reset() before the first step().")

    def _forget(self, ids: Sequence[int]) -> None:
        """Draw anew for episodes whose generators are others."""
        forgotten = np.array(ids, dtype=np.intp)
        self._starts.forget(forgotten)
        self._noise.restart(forgotten)

    def _place(self, ids: Ids, starts: Array) -> None:
        """Put simulations at rest at starts (k, 6), brakes on: the beam may swing, the grasp not.

        So the first force reading needs no forward pass, which for a handful of episodes costs as
        much as a tenth of a step of hundreds.
        """
        swing = self.config.payload.swung(starts[:, 5])
        self.simulation.place(ids, starts[:, :3], starts[:, 3:5], swing)
        self.simulation.report(ids, self._cargo.forces_at_rest(ids, swing))
