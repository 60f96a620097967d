"""One step of n episodes as numbers: observations, rewards, ends and what ``info`` reports."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.compiled import compilable, compiled
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
_EPISODE_COST = _POTENTIALS + len(Potentials._fields)
_NUMBER_COUNT = _EPISODE_COST + 1


class Scores(NamedTuple):
    """What one step brought to n episodes.

    Attributes:
        observations: (n, size), without sensor noise until that is added.
        flags: ``FLAGS``, then whether it terminated and whether it was truncated, (5, n).
        numbers: ``MEASURES``, then reward, potentials and the episode's cost, (19, n).
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
        """``MEASURES``, (13, n)."""
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
def score(
    task: Task,
    goal: Goal,
    workspace: Workspace,
    plant: PlantState,
    ids: NDArray[np.intp],
    actions: Array,
    failed: BoolArray,
    steps: NDArray[np.int64],
    last_step: int,
    before: Scores,
    scores: Scores,
) -> None:
    """Fill in the scores of episodes after a step, or of those that have just begun.

    Args:
        task: its constants.
        goal: of the task.
        workspace: whose borders end episodes.
        plant: the true state.
        ids: the episodes.
        actions: normalized, (n, k).
        failed: whose simulation diverged, (n,).
        steps: control periods since each start, (n,); 0 has neither reward nor end.
        last_step: the one that truncates.
        before: the scores one step ago.
        scores: to be filled in.
    """
    _, size = actions.shape
    for row in range(len(ids)):
        i = ids[row]
        begins = steps[i] == 0
        state = survey(goal, plant, i, scores.observations)
        upper, fore = plant.joints[i, 0], plant.joints[i, 0] + plant.joints[i, 1]
        x, y = plant.base_pose[i, 0], plant.base_pose[i, 1]
        is_outside = not in_workspace(x, y, upper, fore, workspace)
        outcome = Outcome(
            success=is_success(state, task) and not failed[i],
            left_workspace=is_outside and not (failed[i] or begins),
            simulation_failed=failed[i],
        )
        margin, now = constraint_margin(state, task), potentials(state, task)
        costs, terms = 0.0, RewardTerms(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        if not begins:
            squared_action = 0.0
            for k in range(size):
                squared_action += actions[i, k] ** 2
            last = Potentials(
                before.numbers[_POTENTIALS, i],
                before.numbers[_POTENTIALS + 1, i],
                before.numbers[_POTENTIALS + 2, i],
                before.numbers[_POTENTIALS + 3, i],
            )
            costs = before.numbers[_EPISODE_COST, i]
            terms = reward_terms(last, now, squared_action, outcome, margin, task)
        _report(scores, i, state, outcome, terms, now, margin, costs, task)
        terminated = not begins and (outcome.success or is_failure(outcome, margin, task))
        scores.flags[_TERMINATED, i] = terminated
        scores.flags[_TRUNCATED, i] = steps[i] >= last_step and not terminated


@compilable
def _report(
    scores: Scores,
    i: int,
    state: TaskState,
    outcome: Outcome,
    terms: RewardTerms,
    now: Potentials,
    margin: float,
    costs: float,
    task: Task,
) -> None:
    """Write flags and numbers of an episode in the order that ``Scores`` gives them."""
    flags, numbers = scores.flags, scores.numbers
    flags[0, i] = outcome.success
    flags[1, i] = outcome.left_workspace
    flags[2, i] = outcome.simulation_failed
    cost = 1.0 if margin < 0 else 0.0
    numbers[0, i] = cost
    numbers[1, i] = max(state.speed_m_s - task.max_speed_m_s, 0.0)
    numbers[2, i] = margin
    numbers[3, i] = state.distance_m
    numbers[_REWARD, i] = 0.0
    for k in range(len(terms)):
        numbers[_TERMS + k, i] = terms[k]
        numbers[_REWARD, i] += terms[k]
    for k in range(len(now)):
        numbers[_POTENTIALS + k, i] = now[k]
    numbers[_EPISODE_COST, i] = costs + cost
