"""Gains found for beams of many segments, on the nonlinear plant."""

from dataclasses import replace

import numpy as np
import pytest

from defmanip_gym.baselines.analytic.gains import gains_for
from defmanip_gym.baselines.analytic.tanner import TannerController, TannerParams
from defmanip_gym.params import BeamParams

STARTS = ((-4.0, 2.5, 0.0, 1.05, -1.57, 0.05), (-3.0, -2.0, 0.4, 1.1, -1.5, -0.05))
WISHED = TannerParams(
    velocity_field="oriented",
    acceleration_bound=3.0,
    approach_rate=4.0,
    tracking_gain=4.0,
    bound_share=0.6,
    yaw_rate_bound=1.5,
)


@pytest.mark.parametrize("count", [8, 16])
@pytest.mark.parametrize("joint_stiffness", [5.0, 100.0])
@pytest.mark.parametrize("damping_factor", [0.8, 1.25])
def test_many_segments_arrive_within_sigma(make_batch, count, joint_stiffness, damping_factor):
    known = BeamParams(segment_count=count, joint_stiffness=joint_stiffness)
    true = replace(known, damping=damping_factor * known.damping)
    controller = TannerController(beam=known, params=gains_for(known, params=WISHED))
    env = make_batch(2, beam=true)
    observation, _ = env.reset(options={"start": np.array(STARTS)})
    memory, first = None, np.ones(2, dtype=bool)
    arrived = np.zeros(2, dtype=bool)
    for _ in range(400):
        action, memory = controller.predict(observation, memory, first)
        observation, _, _, _, info = env.step(np.where(arrived[:, None], 0.0, action))
        first = np.zeros(2, dtype=bool)
        arrived |= info["is_success"]
        assert (arrived | (info["constraint_margin"] > 0)).all()
        if arrived.all():
            return
    pytest.fail(f"arrived after 8 s: {arrived}")
