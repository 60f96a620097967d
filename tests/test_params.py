import math
from dataclasses import replace

import numpy as np
import pytest

from defmanip_gym.errors import DefmanipError, ParameterError
from defmanip_gym.params import (
    PAPER_DISTURBANCE,
    BeamParams,
    BeamRanges,
    DisturbanceParams,
    LinkParams,
    RobotParams,
    validated_sigma,
)
from defmanip_gym.task_params import RewardParams, StartParams, TaskParams

NAN, INF = float("nan"), float("inf")
POSITIVE = (0.0, -1.0, NAN, INF, None, "1")
NON_NEGATIVE = (-1e-9, NAN, INF, None, "1")
NO_RANGE = (
    *((1.0,), (1.0, 2.0, 3.0), (2.0, 1.0), (-1.0, 1.0), (NAN, 1.0), (1.0, NAN), (1.0, INF)),
    *((1.0, 1e6), (1.0, "2"), (1.0, None), (False, True), "12", 1.0, {1.0: 2.0}),
)
POSITIVE_RANGES = ("mass_kg", "length_m")

BAD = [
    *((LinkParams, {"length_m": 1.0, "mass_kg": 1.0}, "length_m", bad) for bad in POSITIVE),
    *((LinkParams, {"length_m": 1.0, "mass_kg": 1.0}, "mass_kg", bad) for bad in POSITIVE),
    *((LinkParams, {"length_m": 1.0, "mass_kg": 1.0}, "radius_m", bad) for bad in POSITIVE),
    *(
        (RobotParams, {}, name, bad)
        for name in (
            "base_mass_kg",
            "base_yaw_inertia_kgm2",
            "shoulder_height_m",
            "drive_force_limit_n",
            "steering_torque_limit_nm",
            "shoulder_torque_limit_nm",
            "elbow_torque_limit_nm",
        )
        for bad in POSITIVE
    ),
    *((RobotParams, {}, "joint_armature_kgm2", bad) for bad in NON_NEGATIVE),
    *((BeamParams, {}, "mass_kg", bad) for bad in POSITIVE),
    *((BeamParams, {}, "length_m", bad) for bad in POSITIVE),
    *((BeamParams, {}, "radius_m", bad) for bad in POSITIVE),
    *(
        (BeamParams, {}, name, bad)
        for name in ("damping", "joint_stiffness", "joint_damping")
        for bad in NON_NEGATIVE
    ),
    *((BeamParams, {}, "segment_count", bad) for bad in (0, -1, 1.5, True, NAN, "2")),
    *((BeamRanges, {}, name, bad) for name in ("damping", *POSITIVE_RANGES) for bad in NO_RANGE),
    *((BeamRanges, {}, name, (0.0, 1.0)) for name in POSITIVE_RANGES),
    *((RewardParams, {}, "success_bonus", bad) for bad in NON_NEGATIVE),
    *((StartParams, {}, "center", bad) for bad in ((0.0,) * 5, (NAN,) * 6)),
    *((StartParams, {}, "spread", bad) for bad in ((0.0,) * 7, (INF,) * 6, (-0.1,) * 6)),
    *((TaskParams, {}, "goal", bad) for bad in ((0.0,) * 5, (0, 0, 0, 0, 0, NAN))),
    *(
        (TaskParams, {}, name, bad)
        for name in (
            "max_acceleration_m_s2",
            "max_speed_m_s",
            "position_tolerance_m",
            "speed_tolerance_m_s",
            "swing_tolerance_rad",
            "heading_tolerance_rad",
            "arena_radius_m",
            "smallest_reach_m",
            "smallest_grasp_height_m",
            "control_period_s",
            "physics_period_s",
        )
        for bad in POSITIVE
    ),
    *((TaskParams, {}, "control_period_s", bad) for bad in (0.004, 0.0125)),
    *((TaskParams, {}, "smallest_elbow_bend_rad", bad) for bad in (0.0, math.pi / 2, NAN)),
    *((DisturbanceParams, {}, "force_bias_n", bad) for bad in (NAN, INF, 1e5)),
    *((DisturbanceParams, {}, "force_sensor_noise_n", bad) for bad in NON_NEGATIVE),
    *((DisturbanceParams, {}, "swing_sensor_noise_rad", bad) for bad in NON_NEGATIVE),
]


@pytest.mark.parametrize(("kind", "others", "name", "bad"), BAD)
def test_bad_value_is_refused_with_name_range_and_remedy(kind, others, name, bad):
    with pytest.raises(ParameterError) as caught:
        kind(**{**others, name: bad})
    error = caught.value
    assert error.name == name
    assert error.allowed
    assert error.remedy
    for part in (name, repr(bad), error.allowed, error.remedy):
        assert part in str(error)
    assert isinstance(error, DefmanipError)
    assert isinstance(error, ValueError)


@pytest.mark.parametrize("bad", [0.0, -0.1, math.pi / 3, 2.0, NAN])
def test_sigma_has_to_stay_within_the_linearizations_range(bad):
    with pytest.raises(ParameterError, match="sigma_rad"):
        validated_sigma(bad)


def test_admissible_sigma_is_returned():
    assert validated_sigma(math.pi / 6) == math.pi / 6


def test_parameters_are_frozen_and_named():
    with pytest.raises(AttributeError):
        BeamParams().mass_kg = 2.0
    with pytest.raises(TypeError):
        BeamParams(3.0)


def test_numpy_scalars_are_numbers():
    assert BeamParams(mass_kg=np.float64(2.0), segment_count=2).segment_mass_kg == 1.0


def test_derived_quantities():
    beam = BeamParams(mass_kg=3.0, length_m=0.6, segment_count=3)
    assert (beam.segment_mass_kg, beam.segment_length_m) == (pytest.approx(1.0), pytest.approx(0.2))
    assert TaskParams().substeps == 4
    assert PAPER_DISTURBANCE.has_force
    assert not DisturbanceParams().has_force
    assert StartParams().largest_swing_rad == pytest.approx(0.05)


def test_ranges_given_as_lists_are_kept_as_tuples_of_floats():
    ranges = BeamRanges(damping=[0, 1], mass_kg=[np.float64(2.0), 2])
    assert (ranges.damping, ranges.mass_kg, ranges.length_m) == ((0.0, 1.0), (2.0, 2.0), None)
    assert {type(end) for end in (*ranges.damping, *ranges.mass_kg)} == {float}
    hash(ranges)


@pytest.mark.parametrize("name", ["damping", "mass_kg", "length_m"])
def test_one_range_makes_ranges_not_empty(name):
    assert BeamRanges().is_empty
    assert not BeamRanges(**{name: (1.0, 1.0)}).is_empty


@pytest.mark.parametrize("given", [(), (0,), (1,), (2,), (0, 2), (0, 1, 2)])
def test_beams_are_drawn_in_the_order_damping_mass_length_for_the_ranges_given(given):
    everything = (("damping", (0.0, 1.0)), ("mass_kg", (2.0, 4.0)), ("length_m", (0.5, 0.6)))
    ranges = [everything[index] for index in given]
    generator = np.random.default_rng(5)
    expected = {name: generator.uniform(low, high) for name, (low, high) in ranges}
    base = BeamParams(segment_count=3, radius_m=0.01)
    beam = BeamRanges(**dict(reversed(ranges))).sample(base, np.random.default_rng(5))
    assert beam == replace(base, **expected)


def test_drawn_beams_fill_the_range_and_stay_inside():
    generator = np.random.default_rng(0)
    ranges = BeamRanges(mass_kg=(1.0, 3.0), length_m=(0.7, 0.7))
    beams = [ranges.sample(BeamParams(), generator) for _ in range(1000)]
    masses = [beam.mass_kg for beam in beams]
    assert 1.0 <= min(masses) < 1.02
    assert 2.98 < max(masses) <= 3.0
    assert {beam.length_m for beam in beams} == {0.7}
    assert all(type(mass) is float for mass in masses)


def test_range_of_lengths_with_beams_too_stubby_for_a_rod_is_refused_before_any_draw():
    ranges, generator = BeamRanges(length_m=(0.1, 2.0)), np.random.default_rng(0)
    state = generator.bit_generator.state
    ranges.require_fit(BeamParams(segment_count=2))
    for act in (ranges.require_fit, lambda beam: ranges.sample(beam, generator)):
        with pytest.raises(ParameterError, match="3 segments") as caught:
            act(BeamParams(segment_count=3))
        assert (caught.value.name, caught.value.value) == ("length_m", (0.1, 2.0))
    assert generator.bit_generator.state == state
