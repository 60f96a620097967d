"""Nonlinear beams on an accelerating grasp, integrated batch-wise: the adversaries' playground."""

import numpy as np

from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.payload.object_model import HangingBeam


def one_hinge_acceleration(beam: BeamParams):
    """Return φ̈(φ, φ̇, a_x, a_z, u2) of one rod, written down without the package's chain."""
    moment = beam.mass_kg * beam.length_m / 2
    inertia = beam.mass_kg * beam.length_m**2 / 3
    centrifugal = inertia - beam.mass_kg * beam.radius_m**2 / 2

    def acceleration(phi, rate, forward, upward, yaw_rate):
        sin, cos = np.sin(phi), np.cos(phi)
        torque = moment * ((GRAVITY_M_S2 + upward) * sin + forward * cos) + beam.damping * rate
        return (centrifugal * yaw_rate**2 * sin * cos - torque) / inertia

    return acceleration


def chain_acceleration(beam: BeamParams):
    """Return the same for N segments, (n, N), from Eq. (6b)."""
    model = HangingBeam(beam)

    def acceleration(phi, rate, forward, upward, yaw_rate):
        yaw_rate = np.broadcast_to(yaw_rate, phi.shape[:-1])
        partition = model.partition(phi, rate, yaw_rate)
        torque = model.internal_torque(partition, phi, rate)
        torque = torque + partition.m_o12[..., 0, :] * np.asarray(forward)[..., None]
        torque = torque + partition.m_o12[..., 2, :] * np.asarray(upward)[..., None]
        return -np.linalg.solve(partition.m_o22, torque[..., None])[..., 0]

    return acceleration


def largest_swing(acceleration, command, start, *, duration_s, period_s):
    """Return max |φ| over time of RK4 with commands (a_x, a_z, u2) held over each period."""
    phi, rate = np.array(start, dtype=float), np.zeros_like(start)
    peak, h = np.abs(phi), period_s
    for k in range(round(duration_s / h)):
        held = command(k * h, phi, rate)
        a1 = acceleration(phi, rate, *held)
        r2 = rate + h / 2 * a1
        a2 = acceleration(phi + h / 2 * rate, r2, *held)
        r3 = rate + h / 2 * a2
        a3 = acceleration(phi + h / 2 * r2, r3, *held)
        r4 = rate + h * a3
        a4 = acceleration(phi + h * r3, r4, *held)
        phi = phi + h / 6 * (rate + 2 * r2 + 2 * r3 + r4)
        rate = rate + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        peak = np.maximum(peak, np.abs(phi))
    return peak
