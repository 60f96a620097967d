"""The MuJoCo model of base, arm and what it carries, from parameters.

Contacts are off: the task is about dynamics, and the paper's start lets the beam's tip pass 3 cm
below the floor's plane.
"""

from __future__ import annotations

import mujoco

from defmanip_gym.params import GRAVITY_M_S2, LinkParams, RobotParams
from defmanip_gym.plant import names
from defmanip_gym.plant.beam_body import add_pitch_hinge, set_inertia
from defmanip_gym.plant.payload_body import PayloadBody
from defmanip_gym.plant.scene import (
    ROBOT_COLOR,
    WHEEL_COLOR,
    add_base_cameras,
    add_grasp_camera,
    dress,
)

# N·s/m: at 60 kg and 1 m/s² of lateral acceleration the base slips 0.06 mm/s
_NO_SLIP_GAIN = 1e6


def build_model(
    robot: RobotParams,
    body: PayloadBody,
    *,
    goal_position_m: tuple[float, float, float],
    physics_period_s: float,
) -> mujoco.MjModel:
    """Compile the plant.

    Args:
        robot: true robot parameters.
        body: what it truly carries.
        goal_position_m: where the goal marker stands, world frame.
        physics_period_s: integration step.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "deform_transport"
    spec.compiler.degree = False  # as objects from files are compiled
    spec.option.timestep = physics_period_s
    spec.option.gravity = [0.0, 0.0, -GRAVITY_M_S2]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    dress(spec, goal_position_m)
    base = _add_base(spec, robot)
    forearm = _add_arm(base, robot)
    forearm.add_site(
        name=names.GRASP_SITE, pos=[robot.forearm.length_m, 0, 0], size=[0.03], rgba=ROBOT_COLOR
    )
    add_grasp_camera(forearm, robot.forearm.length_m)
    _add_payload(spec, forearm, robot, body)
    _add_actuators(spec, robot)
    return spec.compile()


def _add_base(spec: mujoco.MjSpec, robot: RobotParams) -> mujoco.MjsBody:
    base = spec.worldbody.add_body(name=names.BASE)
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    base.add_joint(name=names.BASE_X, type=slide, axis=[1, 0, 0])
    base.add_joint(name=names.BASE_Y, type=slide, axis=[0, 1, 0])
    base.add_joint(name=names.BASE_YAW, type=hinge, axis=[0, 0, 1])
    # only yaw is free, so any admissible roll and pitch inertia will do
    set_inertia(base, robot.base_mass_kg, [0, 0, 0.15], [robot.base_yaw_inertia_kgm2] * 3)
    base.add_site(name=names.BASE_SITE, rgba=[0, 0, 0, 0])
    _add_base_geoms(base, robot.shoulder_height_m)
    add_base_cameras(base)
    return base


def _add_base_geoms(base: mujoco.MjsBody, height: float) -> None:
    box, cylinder = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER
    base.add_geom(
        name="chassis", type=box, size=[0.32, 0.2, 0.08], pos=[0, 0, 0.16], rgba=ROBOT_COLOR, mass=0
    )
    base.add_geom(
        name="column",
        type=cylinder,
        fromto=[0, 0, 0.2, 0, 0, height],
        size=[0.06, 0, 0],
        rgba=WHEEL_COLOR,
        mass=0,
    )
    for name, side in (("left_wheel", 0.23), ("right_wheel", -0.23)):
        base.add_geom(
            name=name,
            type=cylinder,
            fromto=[0, side - 0.03, 0.11, 0, side + 0.03, 0.11],
            size=[0.11, 0, 0],
            rgba=WHEEL_COLOR,
            mass=0,
        )
    base.add_geom(
        name="nose",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[0.05, 0, 0],
        pos=[0.28, 0, 0.07],
        rgba=WHEEL_COLOR,
        mass=0,
    )


def _add_arm(base: mujoco.MjsBody, robot: RobotParams) -> mujoco.MjsBody:
    upper_arm = base.add_body(name=names.UPPER_ARM, pos=[0, 0, robot.shoulder_height_m])
    add_pitch_hinge(upper_arm, names.SHOULDER, robot.joint_armature_kgm2)
    _add_link(upper_arm, robot.upper_arm, "upper_arm_geom")
    forearm = upper_arm.add_body(name=names.FOREARM, pos=[robot.upper_arm.length_m, 0, 0])
    add_pitch_hinge(forearm, names.ELBOW, robot.joint_armature_kgm2)
    _add_link(forearm, robot.forearm, "forearm_geom")
    return forearm


def _add_payload(
    spec: mujoco.MjSpec, forearm: mujoco.MjsBody, robot: RobotParams, body: PayloadBody
) -> None:
    held = body.attach(spec, forearm, robot)
    site = held.add_site(name="beam_root", rgba=[0, 0, 0, 0])
    spec.add_sensor(
        name=names.GRASP_FORCE,
        type=mujoco.mjtSensor.mjSENS_FORCE,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        objname=site.name,
    )


def _add_actuators(spec: mujoco.MjSpec, robot: RobotParams) -> None:
    joint, site = mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_SITE
    forward = [1.0, 0, 0, 0, 0, 0]
    targets = (
        (names.BASE_SITE, site, forward),
        (names.BASE_YAW, joint, [1.0, 0, 0, 0, 0, 0]),
        (names.SHOULDER, joint, [1.0, 0, 0, 0, 0, 0]),
        (names.ELBOW, joint, [1.0, 0, 0, 0, 0, 0]),
    )
    for name, limit, (target, transmission, gear) in zip(
        names.ACTUATORS, robot.force_limits, targets, strict=True
    ):
        motor = spec.add_actuator(name=name, target=target, trntype=transmission, gear=gear)
        motor.set_to_motor()
        motor.ctrllimited = True
        motor.ctrlrange = [-limit, limit]
    wheel = spec.add_actuator(
        name=names.NO_SLIP, target=names.BASE_SITE, trntype=site, gear=[0, 1.0, 0, 0, 0, 0]
    )
    wheel.set_to_velocity(kv=_NO_SLIP_GAIN)


def _add_link(body: mujoco.MjsBody, link: LinkParams, geom_name: str) -> None:
    across = link.mass_kg * link.length_m**2 / 12
    along = link.mass_kg * link.radius_m**2 / 2
    set_inertia(body, link.mass_kg, [link.length_m / 2, 0, 0], [along, across, across])
    body.add_geom(
        name=geom_name,
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[0, 0, 0, link.length_m, 0, 0],
        size=[link.radius_m, 0, 0],
        rgba=ROBOT_COLOR,
        mass=0,
    )
