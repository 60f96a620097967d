"""Lemma III.1 against MuJoCo's own energy."""

import numpy as np
import pytest
from hanging_rig import HangingRig

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.theory.payload.passivity import dissipation, storage


@pytest.mark.parametrize("count", [1, 3])
def test_energy_of_the_plant_is_the_storage_function_and_falls_by_the_damping(count):
    beam = BeamParams(damping=0.7, segment_count=count, root_stiffness=2.0)
    model, rig = HangingBeam(beam), HangingRig(beam, physics_period_s=2e-4)
    rig.place(np.zeros(count))
    at_rest = rig.energy
    rig.place(np.linspace(1.2, 0.8, count), np.linspace(-1.0, 2.0, count))
    before, lost = rig.energy, 0.0
    for _ in range(40):
        power = dissipation(model, rig.swing_rate)
        assert rig.energy - at_rest == pytest.approx(storage(model, rig.swing, rig.swing_rate))
        for _ in range(25):
            rig.step()
            following = dissipation(model, rig.swing_rate)
            lost += rig.period_s * (power + following) / 2
            power = following
    assert lost > 0.1
    assert rig.energy == pytest.approx(before - lost, abs=2e-4)
