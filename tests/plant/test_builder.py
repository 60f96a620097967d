import mujoco
import numpy as np
import pytest

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.plant import names
from defmanip_gym.plant.builder import build_model
from defmanip_gym.plant.rod_body import RodBody


def build(beam=None):
    return build_model(
        RobotParams(),
        RodBody(beam or BeamParams()),
        goal_position_m=(0, 0, 1),
        physics_period_s=0.005,
    )


@pytest.mark.parametrize("segments", [1, 2, 5])
def test_every_joint_body_and_actuator_is_named(segments):
    model = build(BeamParams(segment_count=segments))
    for kind, count in (
        (mujoco.mjtObj.mjOBJ_BODY, model.nbody),
        (mujoco.mjtObj.mjOBJ_JOINT, model.njnt),
        (mujoco.mjtObj.mjOBJ_ACTUATOR, model.nu),
        (mujoco.mjtObj.mjOBJ_GEOM, model.ngeom),
        (mujoco.mjtObj.mjOBJ_SITE, model.nsite),
        (mujoco.mjtObj.mjOBJ_SENSOR, model.nsensor),
        (mujoco.mjtObj.mjOBJ_TENDON, model.ntendon),
    ):
        assert all(mujoco.mj_id2name(model, kind, index) for index in range(count))
    assert model.njnt == 5 + segments


def test_masses_and_limits_are_those_of_the_parameters():
    model, robot, beam = build(BeamParams(segment_count=4)), RobotParams(), BeamParams()
    mass = robot.base_mass_kg + robot.upper_arm.mass_kg + robot.forearm.mass_kg + beam.mass_kg
    assert model.body_mass.sum() == pytest.approx(mass)
    limits = [model.actuator(name).ctrlrange[1] for name in names.ACTUATORS]
    np.testing.assert_allclose(limits, robot.force_limits)


def test_integrator_is_the_one_whose_accelerations_are_those_of_the_motion():
    assert build().opt.integrator == mujoco.mjtIntegrator.mjINT_DISCRETE


@pytest.mark.parametrize("changes", [{"segment_count": 20}, {"radius_m": 0.5}, {"length_m": 0.03}])
def test_segments_too_stubby_for_a_rod_are_refused_by_the_parameters(changes):
    # MuJoCo answers axial inertia > 2 × transverse, radius > length / √3, with a bare ValueError
    with pytest.raises(ParameterError):
        build(BeamParams(**changes))
