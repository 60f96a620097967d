"""One step of n episodes as numbers: observations, rewards, ends and what ``info`` reports."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compiled
from defmanip_gym.envs.survey import Goal, survey
from defmanip_gym.envs.task import (
    Outcome,
    Potentials,
    RewardTerms,
    Task,
    TaskState,
    constraint_margin,
    is_failure,
    is_success,
    potentials,
    reward_terms,
)
from defmanip_gym.envs.workspace import Workspace, in_workspace
from defmanip_gym.plant.plant_state import PlantState

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

FLAGS = ("is_success", "left_workspace", "simulation_failed")
MEASURES = (
    "cost",
    "cost_speed",
    "constraint_margin",
    "distance_to_goal",
    *RewardTerms._fields,
)
# rows of ``Scores.flags`` and ``Scores.numbers`` that follow these
_TERMINATED, _TRUNCATED = len(FLAGS), len(FLAGS) + 1
_TERMS = MEASURES.index(RewardTerms._fields[0])
_REWARD = len(MEASURES)
_POTENTIALS = _REWARD + 1
_COST, _EPISODE_COST = MEASURES.index("cost"), _POTENTIALS + len(Potentials._fields)
_NUMBER_COUNT = _EPISODE_COST + 1


class Scores(NamedTuple):
    """What one step brought to n episodes.

    Attributes:
        observations: (n, size), without sensor noise until that is added.
        flags: ``FLAGS``, then whether it terminated and whether it was truncated, (5, n).
        numbers: ``MEASURES``, then reward, potentials and the episode's cost, (17, n).
    """

    observations: Array
    flags: BoolArray
    numbers: Array

    @classmethod
    def empty(cls, count: int, observation_size: int) -> Scores:
        """Return scores of ``count`` episodes yet to be filled in."""
        return cls(
            np.empty((count, observation_size)),
            np.empty((_TRUNCATED + 1, count), dtype=np.bool_),
            np.empty((_NUMBER_COUNT, count)),
        )

    def copy(self) -> Scores:
        """Return scores that can be written without changing these."""
        return Scores(self.observations.copy(), self.flags.copy(), self.numbers.copy())

    @property
    def told_flags(self) -> BoolArray:
        """``FLAGS``, (3, n)."""
        return self.flags[:_TERMINATED]

    @property
    def measures(self) -> Array:
        """``MEASURES``, (12, n)."""
        return self.numbers[:_REWARD]

    @property
    def episode_costs(self) -> Array:
        """The sum of ``cost`` over the steps of each episode so far, (n,)."""
        costs: Array = self.numbers[_EPISODE_COST]
        return costs

    @property
    def rewards(self) -> Array:
        """The sum of the reward terms, (n,)."""
        rewards: Array = self.numbers[_REWARD]
        return rewards

    @property
    def terminated(self) -> BoolArray:
        """Which episodes ended by what happened in them, (n,)."""
        terminated: BoolArray = self.flags[_TERMINATED]
        return terminated

    @property
    def truncated(self) -> BoolArray:
        """Which episodes ended because their time was over, (n,)."""
        truncated: BoolArray = self.flags[_TRUNCATED]
        return truncated


@compiled
def score_starts(
    task: Task, goal: Goal, plant: PlantState, ids: NDArray[np.intp], scores: Scores
) -> None:
    """Fill in the scores of the episodes ``ids`` that have just begun."""
    no_reward = RewardTerms(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in ids:
        state = survey(goal, plant, i, scores.observations[i])
        outcome = Outcome(is_success(state, task), False, False)
        _report(scores, i, state, outcome, no_reward, potentials(state, task), task)
        scores.flags[_TERMINATED, i] = scores.flags[_TRUNCATED, i] = False
        scores.numbers[_EPISODE_COST, i] = 0.0


@compiled
def score_steps(
    task: Task,
    goal: Goal,
    workspace: Workspace,
    plant: PlantState,
    actions: Array,
    failed: BoolArray,
    steps: NDArray[np.int64],
    last_step: int,
    before: Scores,
    scores: Scores,
) -> None:
    """Fill in the scores of all episodes after a step.

    Args:
        task: its constants.
        goal: of the task.
        workspace: whose borders end episodes.
        plant: the true state.
        actions: normalized, (n, k).
        failed: whose simulation diverged, (n,).
        steps: control periods since each start, (n,).
        last_step: the one that truncates.
        before: the scores one step ago.
        scores: to be filled in.
    """
    for i in range(len(actions)):
        state = survey(goal, plant, i, scores.observations[i])
        upper, fore = plant.joints[i, 0], plant.joints[i, 0] + plant.joints[i, 1]
        is_inside = in_workspace(plant.base_pose[i], upper, fore, workspace)
        outcome = Outcome(
            success=is_success(state, task) and not failed[i],
            left_workspace=not failed[i] and not is_inside,
            simulation_failed=failed[i],
        )
        margin = constraint_margin(state, task)
        squared_action = 0.0
        for k in range(actions.shape[1]):
            squared_action += actions[i, k] ** 2
        last = Potentials(
            before.numbers[_POTENTIALS, i],
            before.numbers[_POTENTIALS + 1, i],
            before.numbers[_POTENTIALS + 2, i],
        )
        now = potentials(state, task)
        terms = reward_terms(last, now, squared_action, outcome, margin, task)
        _report(scores, i, state, outcome, terms, now, task)
        scores.numbers[_EPISODE_COST, i] = (
            before.numbers[_EPISODE_COST, i] + scores.numbers[_COST, i]
        )
        terminated = outcome.success or is_failure(outcome, margin, task)
        scores.flags[_TERMINATED, i] = terminated
        scores.flags[_TRUNCATED, i] = steps[i] >= last_step and not terminated


@compiled
def _report(
    scores: Scores,
    i: int,
    state: TaskState,
    outcome: Outcome,
    terms: RewardTerms,
    now: Potentials,
    task: Task,
) -> None:
    """Write flags and numbers of an episode in the order that ``Scores`` gives them."""
    margin = constraint_margin(state, task)
    scores.flags[0, i] = outcome.success
    scores.flags[1, i] = outcome.left_workspace
    scores.flags[2, i] = outcome.simulation_failed
    scores.numbers[0, i] = 1.0 if margin < 0 else 0.0
    scores.numbers[1, i] = max(state.speed_m_s - task.max_speed_m_s, 0.0)
    scores.numbers[2, i] = margin
    scores.numbers[3, i] = state.distance_m
    scores.numbers[_REWARD, i] = 0.0
    for k in range(len(terms)):
        scores.numbers[_TERMS + k, i] = terms[k]
        scores.numbers[_REWARD, i] += terms[k]
    for k in range(len(now)):
        scores.numbers[_POTENTIALS + k, i] = now[k]
