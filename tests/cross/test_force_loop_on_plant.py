"""Jury's region of the sampled force loop, and Proposition V.1, on a beam with a driven grasp."""

import numpy as np
import pytest
from hanging_rig import HangingRig

from defmanip_gym.params import GRAVITY_M_S2, BeamParams
from defmanip_gym.theory.control.continuous_loop import closed_loop_matrix
from defmanip_gym.theory.control.control_laws import ForceLoopGains, force_loop
from defmanip_gym.theory.control.stability import force_loop_is_stable, smallest_k2
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.theory.payload.zero_dynamics import is_hurwitz

PERIOD_S, SUBSTEPS = 0.02, 10
GRASP_MASS_KG = 10.0
FORCE_BIAS_N = np.array([0.5, 0.0, 0.0])


def force_errors(gains, *, tracking_gain=0.0, samples=80):
    """Return |Δu_o| at each sample; w is held for a period, the beam compensated in between.

    The measured force answers to the command of the sample before: the delay of any computer.
    """
    beam = BeamParams(damping=0.5)
    model, still = HangingBeam(beam), np.zeros(())
    rig = HangingRig(beam, grasp_mass_kg=GRASP_MASS_KG, physics_period_s=PERIOD_S / SUBSTEPS)
    rig.place(np.array([0.1]))
    weight = np.array([0.0, 0.0, GRASP_MASS_KG * GRAVITY_M_S2])
    w, integral, u_o, errors = np.zeros(3), np.zeros(3), np.zeros(3), []
    for _ in range(samples):
        for _ in range(SUBSTEPS):
            # Eq. (28) with 𝓜 = GRASP_MASS_KG and F of Eq. (10)
            carried = model.linearizing_force(rig.swing, rig.swing_rate, still, w)
            rig.push(GRASP_MASS_KG * w + weight + carried + FORCE_BIAS_N)
            rig.step()
        measured = rig.force_on_beam()
        error = model.acceleration_error(rig.swing, rig.swing_rate, still, u_o, measured)
        u_o = -tracking_gain * rig.grasp_velocity
        integral = integral + PERIOD_S * error
        w = force_loop(u_o, error, integral, gains)
        errors.append(np.abs(error).max())
        if errors[-1] > 50:
            break
    return np.array(errors)


@pytest.mark.parametrize(
    ("k1", "share"), [(0.4, 0.9), (0.4, 1.1), (0.9, 0.5), (0.0, 0.9), (0.0, 1.1), (1.1, 0.0)]
)
def test_the_force_loop_decays_inside_jurys_region_and_grows_outside(k1, share):
    gains = ForceLoopGains(k1=k1, k2=max(share * 2 * (1 - k1) / PERIOD_S, 0.1))
    errors = force_errors(gains)
    if force_loop_is_stable(gains, PERIOD_S):
        assert errors[-5:].max() < 0.2 * errors[0]
    else:
        assert errors[-1] > 20 * errors[0]


def test_gains_that_proposition_v_1_calls_stable_diverge_in_samples():
    tracking_gain = 1.0
    gains = ForceLoopGains(k1=0.2, k2=1.2 * 2 * (1 - 0.2) / PERIOD_S)
    assert gains.k2 > 300 * smallest_k2(tracking_gain)
    assert is_hurwitz(closed_loop_matrix(-tracking_gain * np.eye(3), gains))
    errors = force_errors(gains, tracking_gain=tracking_gain)
    assert errors[-1] > 20 * errors[0]
