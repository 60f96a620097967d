"""Potentials of the reward: what they call closer."""

import math

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.task import TaskState, potentials, task_of
from defmanip_gym.theory.control.time_to_go import Motion

TASK = task_of(TransportConfig())
AT_REST = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def closeness(*, distance_m, speed_m_s=0.0, swing_rad=0.0):
    state = TaskState(distance_m, 0.0, speed_m_s, 0.0, 0.0, swing_rad, 0.0, AT_REST)
    return potentials(state, TASK).closeness


def test_moving_to_the_goal_is_no_farther_from_it_than_resting():
    resting = closeness(distance_m=0.4)
    assert closeness(distance_m=0.4, speed_m_s=0.4, swing_rad=0.2) == resting
    assert closeness(distance_m=0.4, speed_m_s=0.5) < resting
    assert closeness(distance_m=0.4, swing_rad=0.25) < resting


def test_settling_at_the_goal_comes_closer():
    assert closeness(distance_m=0.0, speed_m_s=0.1) == -5.0 * math.log1p(2.0)
    assert closeness(distance_m=0.0, swing_rad=0.1) == -5.0 * math.log1p(2.0)
    assert closeness(distance_m=0.0) == 0.0
