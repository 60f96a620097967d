"""A beam hanging in MuJoCo from a grasp that is fixed, or free to slide forward and up."""

import mujoco
import numpy as np

from defmanip_gym.params import GRAVITY_M_S2, BeamParams


class HangingRig:
    """Steps the beam under a force at the grasp.

    Args:
        beam: its parameters.
        grasp_mass_kg: mass that slides with the grasp; None holds the grasp still.
        physics_period_s: integration step.
    """

    def __init__(self, beam: BeamParams, *, grasp_mass_kg=None, physics_period_s=1e-3):
        self.beam, self.grasp_mass_kg, self.period_s = beam, grasp_mass_kg, physics_period_s
        self.model = self._build()
        self.data = mujoco.MjData(self.model)
        self._slides = 0 if grasp_mass_kg is None else 2

    def _build(self):
        spec, beam = mujoco.MjSpec(), self.beam
        spec.option.timestep = self.period_s
        spec.option.gravity = [0, 0, -GRAVITY_M_S2]
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        spec.option.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
        parent, position = spec.worldbody, [0, 0, 0]
        if self.grasp_mass_kg is not None:
            parent = parent.add_body()
            for axis in ([1, 0, 0], [0, 0, 1]):
                parent.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
            _set_inertia(parent, self.grasp_mass_kg, 0.0, [1e-6] * 3)
        length, mass = beam.segment_length_m, beam.segment_mass_kg
        across, along = mass * length**2 / 12, mass * beam.radius_m**2 / 2
        for index in range(beam.segment_count):
            body = parent.add_body(pos=position)
            hinge = body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, -1, 0])
            hinge.damping[0] = beam.joint_damping if index else beam.damping
            hinge.stiffness[0] = beam.joint_stiffness if index else beam.root_stiffness
            _set_inertia(body, mass, -length / 2, [across, across, along])
            parent, position = body, [0, 0, -length]
        return spec.compile()

    def place(self, swing, swing_rate=None):
        """Set φ and φ̇, (N,), with the grasp at rest at the origin."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self._slides :] = np.diff(swing, prepend=0.0)
        if swing_rate is not None:
            self.data.qvel[self._slides :] = np.diff(swing_rate, prepend=0.0)
        mujoco.mj_forward(self.model, self.data)

    @property
    def swing(self):
        return np.cumsum(self.data.qpos[self._slides :])

    @property
    def swing_rate(self):
        return np.cumsum(self.data.qvel[self._slides :])

    @property
    def grasp_velocity(self):
        return np.array([self.data.qvel[0], 0.0, self.data.qvel[1]])

    @property
    def energy(self):
        """Kinetic plus potential energy, J, as MuJoCo counts it."""
        mujoco.mj_forward(self.model, self.data)
        return float(self.data.energy.sum())

    def push(self, force):
        """Apply a force (3,) N at the grasp until set anew."""
        self.data.qfrc_applied[:2] = force[0], force[2]

    def force_on_beam(self):
        """Return f̃, (3,) N: what the grasp transmits of the force applied to it."""
        mujoco.mj_forward(self.model, self.data)
        acceleration = np.array([self.data.qacc[0], 0.0, self.data.qacc[1] + GRAVITY_M_S2])
        applied = np.array([self.data.qfrc_applied[0], 0.0, self.data.qfrc_applied[1]])
        return applied - self.grasp_mass_kg * acceleration

    def step(self):
        mujoco.mj_step(self.model, self.data)


def _set_inertia(body, mass, height, diagonal):
    body.explicitinertial = True
    body.mass, body.ipos, body.inertia = mass, [0, 0, height], diagonal
