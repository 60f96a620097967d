"""Backup: what the nominal model shows when it is rolled out, without the plant."""

import math
from dataclasses import replace

import numpy as np
import pytest

from defmanip_gym.errors import ActionError, CertificateError, ParameterError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.filters.backup_filter import BackupFilter
from defmanip_gym.theory.filters.conditions import FilterConditions, PayloadIntervals
from defmanip_gym.theory.filters.foresight import advance_robot
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.storage import StorageRoom, swing_step
from defmanip_gym.theory.filters.storage_filter import StorageFilter

SIGMA = math.pi / 6


def whip(segments, stiffness=5.0, joint_damping=0.02):
    return BeamParams(
        segment_count=segments,
        damping=0.0,
        joint_stiffness=stiffness,
        joint_damping=joint_damping,
    )


def test_the_drawn_edge_of_one_hinge_is_between_storages_and_sigma():
    made, level = BackupFilter(), StorageFilter().edge()
    swing, rate = made.edge()
    assert np.abs(swing).max() < SIGMA - 0.009 * SIGMA
    inside = np.abs(level[0]) < swing.max()
    # where V allows a rate, a rollout shows it too, to within the picture's steps
    assert (np.interp(level[0][inside], swing, rate) > 0.98 * level[1][inside] - 0.02).all()
    assert np.trapezoid(rate, swing) > 1.2 * np.trapezoid(level[1], level[0])
    assert BackupFilter(BeamParams(segment_count=2)).edge() is None


def observed(sensed):
    """What an environment would tell of states, as far as filters look at it."""
    count, segments = sensed.swing.shape
    layout = ObservationLayout(segments)
    observation = np.zeros((count, layout.size))
    parts = {
        "heading": np.column_stack((np.sin(sensed.heading), np.cos(sensed.heading))),
        "grasp_velocity_b": sensed.velocity_b,
        "base_velocity": sensed.base_velocity,
        "joints": sensed.pitch * (1, 1) - np.column_stack((np.zeros(count), sensed.pitch[:, 0])),
        "joint_rates": np.diff(sensed.pitch_rate, axis=1, prepend=0.0),
        "swing": sensed.swing,
        "swing_rate": sensed.swing_rate,
    }
    for name, values in parts.items():
        layout.part(observation, name)[:] = values
    return observation


def hanging(segments, swing=0.0, swing_rate=0.0):
    sensed = Sensed.empty(1, segments)
    sensed.pitch[:] = math.pi / 3, -math.pi / 6
    sensed.swing[:], sensed.swing_rate[:] = swing, swing_rate
    return sensed


class NominalModel:
    """What a backup filter rolls out, in the plant's place."""

    def __init__(self, safety, sensed):
        self.setup, self.sensed = safety.backup, sensed
        self.room = StorageRoom.empty(sensed.swing.shape[1])

    def step(self, command):
        limits, room = self.setup.storage.limits, self.room
        room.swing[:], room.swing_rate[:] = self.sensed.swing[0], self.sensed.swing_rate[0]
        grasp, yaw_rate, _ = advance_robot(limits, tuple(command), (0.0, 0.0, 0.0), self.sensed, 0)
        pushed = grasp[0], grasp[2], yaw_rate
        step_s = limits.period_s / self.setup.substeps
        for _ in range(self.setup.substeps):
            swing_step(self.setup.rolled, 0, room.swing, room.swing_rate, *pushed, step_s, room)
        self.sensed.swing[0], self.sensed.swing_rate[0] = room.swing, room.swing_rate


def started(safety, sensed):
    memory = safety.memory(1)
    safety.begin(memory, observed(sensed), np.array([True]))
    return memory


@pytest.mark.parametrize("segments", [1, 2, 4])
@pytest.mark.parametrize("hold", [1, 3, 7, 15, 40])
def test_on_the_nominal_model_there_always_is_a_safe_command(segments, hold):
    safety = BackupFilter(whip(segments))
    sensed = hanging(segments)
    model, memory = NominalModel(safety, sensed), started(safety, sensed)
    rng = np.random.default_rng(hold)
    reached = 0.0
    for period in range(400):
        if period % hold == 0:
            wished = rng.choice((-3.0, 3.0), (1, 3))
        decision = safety.certify_action(wished, observed(sensed), memory)
        assert decision.margin[0] >= 0
        model.step(decision.allowed_m_s2[0])
        safety.conclude(observed(sensed), memory)
        reached = max(reached, abs(sensed.swing).max())
    assert 0.7 * SIGMA < reached <= SIGMA


def test_one_hinge_at_sigma_that_swings_inwards_is_inside_though_it_stores_too_much():
    state = observed(hanging(1, 0.95 * SIGMA, -1.0))
    backup, storage = BackupFilter(whip(1)), StorageFilter(whip(1))
    assert backup.inside(state, backup.memory(1))[0]
    assert not storage.inside(state, storage.memory(1))[0]


def test_a_whip_is_inside_far_beyond_the_level_of_its_storage():
    state = hanging(8, 0.5 * SIGMA, 0.0)
    safety = BackupFilter(whip(8))
    memory = started(safety, state)
    assert safety.storage_shares(observed(state), memory)[0] > 1.5
    assert safety.inside(observed(state), memory)[0]


def test_where_nothing_is_safe_it_says_so_and_damps():
    state = hanging(1, 0.9 * SIGMA, 3.0)
    safety = BackupFilter(whip(1))
    memory = started(safety, state)
    decision = safety.certify_action(np.array([[-3.0, 0.0, 0.0]]), observed(state), memory)
    assert decision.margin[0] < 0
    assert not safety.inside(observed(state), memory)[0]
    assert decision.allowed_m_s2[0, 0] > 2


@pytest.mark.parametrize("segments", [1, 4])
def test_the_tube_holds_what_errors_make_of_a_coasting_beam(segments):
    safety = BackupFilter(whip(segments))
    setup, rng = safety.backup, np.random.default_rng(0)
    limits, room = setup.storage.limits, StorageRoom.empty(segments)
    for _ in range(5):
        errors = rng.choice((-1, 1), (60, 2)) * setup.storage.errors[[0, 2]]
        paths = []
        for scale in (0.0, 1.0):
            room.swing[:], room.swing_rate[:], path = 0.5 * SIGMA, 0.0, []
            for forward, upward in scale * errors:
                for _ in range(setup.substeps):
                    swing_step(
                        setup.rolled,
                        0,
                        room.swing,
                        room.swing_rate,
                        forward,
                        upward,
                        0.0,
                        limits.period_s / setup.substeps,
                        room,
                    )
                path.append(room.swing.copy())
            paths.append(path)
        moved = np.abs(np.diff(paths, axis=0)[0])
        assert (moved <= setup.tube[1:61]).all()


def test_unequal_beams_leave_less_than_the_believed_one():
    state = observed(hanging(4, 0.75 * SIGMA, 0.0))
    exact = BackupFilter(whip(4))
    wide = BackupFilter(whip(4), intervals=PayloadIntervals(length=(0.6, 1.5)))
    wished = np.array([[-3.0, 0.0, 0.0]])
    margins = [s.certify_action(wished, state, s.memory(1)).margin[0] for s in (exact, wide)]
    assert margins[1] <= margins[0]


def test_delay_asks_for_more_of_sigma():
    slow = BackupFilter(whip(1), conditions=FilterConditions(delay_periods=4))
    quick = BackupFilter(whip(1))
    assert slow.backup.delay == 4
    assert slow.level_share < quick.level_share
    assert slow.tube_rad[1 + 4].max() > quick.tube_rad[1].max()


def test_it_covers_the_damping_that_it_rolls_out():
    believed = BeamParams(damping=0.1, segment_count=2)
    exact = BackupFilter(believed)
    wide = BackupFilter(believed, intervals=PayloadIntervals(damping=(0.1, 10.0)))
    for true in (replace(believed, damping=1.0), replace(believed, joint_damping=0.02)):
        assert wide.covers(true) and not exact.covers(true)
    assert exact.covers(believed)
    assert not wide.covers(replace(believed, damping=2.0))


def test_factors_on_damping_are_not_negative_and_around_the_believed_one():
    for factors in ((-1.0, 1.0), (2.0, 3.0)):
        with pytest.raises(ParameterError, match="damping"):
            PayloadIntervals(damping=factors)


def test_wrong_input_is_refused():
    safety = BackupFilter(whip(2))
    memory, state = safety.memory(1), observed(hanging(2))
    with pytest.raises(ActionError, match="finite"):
        safety.certify_action(np.full((1, 3), np.nan), state, memory)
    with pytest.raises(ActionError, match="shape"):
        safety.certify_action(np.zeros((2, 3)), state, memory)
    with pytest.raises(ParameterError, match="2 segments"):
        safety.certify_action(np.zeros((1, 3)), observed(hanging(3)), memory)


def test_errors_that_leave_nothing_of_sigma_are_refused():
    with pytest.raises(CertificateError, match="σ that errors and delay leave"):
        BackupFilter(whip(2), conditions=FilterConditions(forward_error_m_s2=1000.0))
