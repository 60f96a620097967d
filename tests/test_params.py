import math

import numpy as np
import pytest

from defmanip_gym.errors import DefmanipError, ParameterError
from defmanip_gym.params import (
    PAPER_DISTURBANCE,
    BeamParams,
    DisturbanceParams,
    LinkParams,
    RewardParams,
    RobotParams,
    StartParams,
    TaskParams,
    validated_sigma,
)

NAN, INF = float("nan"), float("inf")
POSITIVE = (0.0, -1.0, NAN, INF, None, "1")
NON_NEGATIVE = (-1e-9, NAN, INF, None, "1")

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
