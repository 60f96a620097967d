"""What of V_σ sampling, errors, noise and delay cost: docs/derivations.md, section 18."""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg

from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.filters.conditions import FilterConditions
from defmanip_gym.theory.filters.storage import StorageModel
from defmanip_gym.theory.filters.swing_estimate import STEADY_SHARE
from defmanip_gym.theory.payload.object_model import HangingBeam


def hanging_modes(beam: BeamParams) -> tuple[Array, Array]:
    """Return natural frequencies, (N,) rad/s, ascending, and shapes, (N, N), about hanging."""
    model = HangingBeam(beam)
    stiffness = model.k_o22 + GRAVITY_M_S2 * np.diag(model.chain.constants.first_moments)
    squares, shapes = scipy.linalg.eigh(stiffness, _hanging_inertia(beam))
    return np.sqrt(squares), shapes


def estimate_drift_rad(beam: BeamParams, pass_j: float, period_s: float) -> float:
    """Return the trapezoidal rule's largest error on φ̇ over a period, within V ≤ V_σ."""
    lightest = float(scipy.linalg.eigvalsh(_hanging_inertia(beam))[0])
    fastest = float(hanging_modes(beam)[0][-1])
    return min(period_s**3 / 12 * fastest**2, period_s) * math.sqrt(2 * pass_j / lightest)


def reserved_shares(
    model: StorageModel,
    beam: BeamParams,
    *,
    sigma_rad: float,
    conditions: FilterConditions,
    task: TaskParams,
) -> Array:
    """Return the shares of V_σ that are kept back, (C,).

    Args:
        model: of the beams that may be carried.
        beam: the believed one.
        sigma_rad: σ.
        conditions: errors, noise and delay.
        task: limits and control period.
    """
    period_s, passes = task.control_period_s, model.passes
    forward = largest_momenta(model)
    upward = 0.5 * math.tan(sigma_rad) * forward
    per_period = period_s * (
        forward * conditions.forward_error_m_s2 + upward * conditions.vertical_error_m_s2
    )
    offsets = period_s * (
        forward * conditions.forward_offset_m_s2 + upward * conditions.vertical_offset_m_s2
    )
    # at the speed limit, where damping may not accelerate, velocity follows offsets a period late
    at_the_limit = 2 * (offsets + per_period)
    swinging_rad = hanging_modes(beam)[0][0] * period_s
    ripple = conditions.storage_error * passes / swinging_rad
    delay = conditions.delay_periods
    # what is j periods old has changed j times, but not by more than offsets allow
    changes = sum(np.minimum(j * per_period, 2 * offsets) for j in range(1, delay + 1))
    delayed = changes + delay * conditions.storage_error * passes
    # an angle that is wrong when it is measured has turned into a rate that is
    turned = min(delay * swinging_rad, 1.0) * STEADY_SHARE * conditions.swing_noise_rad
    delayed += turned * GRAVITY_M_S2 * math.sin(sigma_rad) * model.moments.sum(axis=1)
    # between samples V is at most this much above the larger of its ends
    largest = task.max_acceleration_m_s2
    pull = GRAVITY_M_S2 * math.sin(sigma_rad) + largest
    between = period_s**2 / 8 * _yielding_mass(model) * pull * largest
    shares: Array = (at_the_limit + ripple + delayed + between) / passes
    return shares


def largest_momenta(model: StorageModel) -> Array:
    """Return |s_f| at its largest within V ≤ V_σ, (C,) kg·m/s."""
    momenta: Array = np.sqrt(2 * _yielding_mass(model) * model.passes)
    return momenta


def _hanging_inertia(beam: BeamParams) -> Array:
    """Return m_o22 hanging, (N, N) kg·m²."""
    chain = HangingBeam(beam).chain
    return chain.mass_matrix(np.full(beam.segment_count, -np.pi / 2))[2:, 2:]


def _yielding_mass(model: StorageModel) -> Array:
    """Return m_o12 m_o22⁻¹ m_o12ᵀ hanging, forward, (C,) kg: |s_f|² is at most 2 V times it."""
    own = np.eye(model.moments.shape[1]) * model.inertia[:, None, :]
    yields = np.linalg.solve(model.coupling + own, model.moments[..., None])[..., 0]
    mass: Array = (model.moments * yields).sum(axis=1)
    return mass
