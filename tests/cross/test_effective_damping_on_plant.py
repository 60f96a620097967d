"""D_eff = D − Γ(D̂ − D) on the plant: a beam carried by nothing but the force of Eq. (10)."""

from dataclasses import replace

import numpy as np
import pytest
from hanging_rig import HangingRig

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.control.effective_damping import (
    force_tracking_gain,
    largest_assumed_damping_factor,
    under_force_tracking,
)
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.theory.payload.zero_dynamics import linearize

PERIOD_S = 2e-3
BRAKE = 1e-3  # 1/s, so slow that it does not take part in the swing


def carried_swing(beam, assumed, *, seconds):
    """Return φ_1 over time of a beam whose grasp feels only the force law's F, (steps,)."""
    rig = HangingRig(beam, grasp_mass_kg=1e-6, physics_period_s=PERIOD_S)
    rig.place(np.full(beam.segment_count, 0.02))
    still, swing = np.zeros(()), []
    for _ in range(round(seconds / PERIOD_S)):
        u_o = -BRAKE * rig.grasp_velocity
        rig.push(assumed.linearizing_force(rig.swing, rig.swing_rate, still, u_o))
        rig.step()
        swing.append(rig.swing[0])
    return np.array(swing)


def growth(swing):
    """Return the growth rate, 1/s, of the peaks of a decaying or growing swing (steps,)."""
    magnitude = np.abs(swing)
    inner = magnitude[1:-1]
    peaks = 1 + np.flatnonzero((inner > magnitude[:-2]) & (inner > magnitude[2:]))
    return np.polyfit(PERIOD_S * peaks, np.log(magnitude[peaks]), 1)[0]


def predicted_growth(beam, assumed):
    linear = linearize(beam)
    # a force held for a period acts half of it late: its −K φ damps a little
    stiffness = linear.k_o22 + linear.gravity_stiffness
    held = force_tracking_gain(linear) @ stiffness * PERIOD_S / 2
    carried = under_force_tracking(linear, assumed.d_o22)
    return np.linalg.eigvals(replace(carried, d_o22=carried.d_o22 + held).A_u).real.max()


@pytest.mark.parametrize(("factor", "grows"), [(1.25, False), (1.42, True)])
def test_a_rod_decays_just_inside_four_thirds_of_its_damping_and_grows_just_outside(factor, grows):
    beam = BeamParams(damping=1.0)
    assumed = HangingBeam(beam, damping=factor * beam.damping)
    measured = growth(carried_swing(beam, assumed, seconds=3.0))
    assert (measured > 0) == grows
    assert measured == pytest.approx(predicted_growth(beam, assumed), abs=0.01)


@pytest.mark.parametrize(("share", "grows"), [(0.5, False), (1.5, True)])
def test_two_segments_decay_inside_the_factor_of_their_eigenvalues_and_grow_outside(share, grows):
    beam = BeamParams(damping=1.0, segment_count=2)
    law = HangingBeam(beam)
    excess = largest_assumed_damping_factor(linearize(beam)) - 1
    law.d_o22 = (1 + share * excess) * law.d_o22
    settled = carried_swing(beam, law, seconds=3.0)[350:]
    assert (growth(settled) > 0) == grows
    assert growth(settled) == pytest.approx(predicted_growth(beam, law), abs=0.02)
