"""Storage: the barrier's function, its lowest pass, and one period of the object ahead."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.filters.storage import (
    StorageModel,
    StorageRoom,
    lowest_pass,
    power_of,
    storage_at,
    swing_step,
)
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.theory.payload.passivity import storage

SIGMA = math.pi / 6


@cache  # the pass is searched for whenever a model is made
def model_of(beam):
    return StorageModel.of((beam,), SIGMA)


def stored(beam, swing, rate, yaw_rate=0.0):
    room = StorageRoom.empty(len(swing))
    return storage_at(model_of(beam), 0, swing, rate, yaw_rate, room)


def random_states(segments, count=20, seed=0):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield rng.uniform(-SIGMA, SIGMA, segments), rng.normal(size=segments)


@pytest.mark.parametrize("segments", [1, 2, 5])
def test_without_turning_it_is_the_storage_function_of_the_lemma(segments):
    beam = BeamParams(segment_count=segments, root_stiffness=0.7)
    for swing, rate in random_states(segments):
        assert stored(beam, swing, rate) == pytest.approx(
            storage(HangingBeam(beam), swing, rate), rel=1e-12
        )


@pytest.mark.parametrize("segments", [1, 3])
def test_turning_never_makes_it_smaller_within_sigma(segments):
    beam = BeamParams(segment_count=segments)
    for swing, rate in random_states(segments):
        assert stored(beam, swing, rate, yaw_rate=2.0) >= stored(beam, swing, rate)


def test_pass_of_one_hinge_is_the_energy_of_hanging_at_sigma():
    beam = BeamParams()
    energy = beam.mass_kg * 9.81 * beam.length_m / 2 * (1 - math.cos(SIGMA))
    assert lowest_pass(beam, SIGMA)[0] == pytest.approx(energy)


def test_passes_of_equal_segments_are_those_of_the_notes():
    rigid = lowest_pass(BeamParams(), SIGMA)[0]
    shares = [lowest_pass(BeamParams(segment_count=n), SIGMA)[0] / rigid for n in (2, 3, 4, 8, 16)]
    assert shares == pytest.approx([0.82, 0.69, 0.60, 0.41, 0.26], abs=0.01)


@pytest.mark.parametrize("segments", [1, 2, 4, 8])
def test_no_state_at_sigma_stores_less_than_the_pass(segments):
    beam = BeamParams(segment_count=segments, joint_stiffness=5.0)
    lowest = lowest_pass(beam, SIGMA)[0]
    rng = np.random.default_rng(1)
    for _ in range(500):
        swing = rng.uniform(-SIGMA, SIGMA, segments)
        swing[rng.integers(segments)] = SIGMA * rng.choice((-1, 1))
        assert stored(beam, swing, np.zeros(segments)) >= lowest * (1 - 1e-9)


@pytest.mark.parametrize("segments", [1, 2, 6])
def test_step_is_that_of_the_object_model(segments):
    """The equation of motion holds in the middle of the step, to the order of the step."""
    beam = BeamParams(segment_count=segments, damping=0.0, joint_damping=0.0, joint_stiffness=2.0)
    model = HangingBeam(beam)
    forward, upward, yaw_rate, period_s = 1.3, -0.8, 0.9, 1e-6
    for swing, rate in random_states(segments):
        room = StorageRoom.empty(segments)
        setup = StorageModel.of((beam,), SIGMA)
        swing_step(setup, 0, swing, rate, forward, upward, yaw_rate, period_s, room)
        partition = model.partition(swing, rate, np.array(yaw_rate))
        pushed = partition.m_o12.T @ np.array([forward, 0.0, upward])
        torque = model.internal_torque(partition, swing, rate) + pushed
        acceleration = -np.linalg.solve(partition.m_o22, torque)
        stepped = (room.swing_rate - rate) / period_s
        assert stepped == pytest.approx(acceleration, rel=0.02, abs=0.02)


@pytest.mark.parametrize("segments", [1, 2, 8])
def test_a_coasting_object_keeps_what_it_stores_over_a_hundred_periods(segments):
    beam = BeamParams(segment_count=segments)
    model, room = StorageModel.of((beam,), SIGMA), StorageRoom.empty(segments)
    swing, rate = np.full(segments, 0.4), np.zeros(segments)
    before = stored(beam, swing, rate)
    for _ in range(100):
        swing_step(model, 0, swing, rate, 0.0, 0.0, 0.0, 0.02, room)
        swing, rate = room.swing.copy(), room.swing_rate.copy()
    assert stored(beam, swing, rate) == pytest.approx(before, rel=0.01)


@pytest.mark.parametrize("segments", [1, 3])
def test_the_storage_changes_by_the_power_of_acceleration_and_turning(segments):
    beam = BeamParams(segment_count=segments, joint_stiffness=2.0)
    model, room = StorageModel.of((beam,), SIGMA), StorageRoom.empty(segments)
    period_s, yaw_rate, yaw_acceleration = 1e-5, 0.7, 1.1
    for swing, rate in random_states(segments):
        before = stored(beam, swing, rate, yaw_rate)
        middle = yaw_rate + period_s / 2 * yaw_acceleration
        swing_step(model, 0, swing, rate, 1.0, -0.5, middle, period_s, room)
        forward, upward, inertia = power_of(model, 0, room)
        power = -forward * 1.0 + upward * 0.5 + middle * yaw_acceleration * inertia
        later_yaw_rate = yaw_rate + period_s * yaw_acceleration
        after = stored(beam, room.swing, room.swing_rate, later_yaw_rate)
        assert (after - before) / period_s == pytest.approx(power, rel=0.01, abs=0.01)


def test_mass_of_a_free_rod_does_not_matter():
    light, heavy = BeamParams(mass_kg=1.0), BeamParams(mass_kg=9.0)
    shares = [
        stored(beam, np.array([0.3]), np.array([1.0])) / lowest_pass(beam, SIGMA)[0]
        for beam in (light, replace(heavy, damping=3.0))
    ]
    assert shares[0] == pytest.approx(shares[1])
