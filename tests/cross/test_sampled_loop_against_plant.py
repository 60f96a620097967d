"""The spectral radius of SampledLoop against the swing of the nonlinear plant."""

import math
from dataclasses import replace

import numpy as np
import pytest

from defmanip_gym.baselines.analytic.tanner import GENTLE_PARAMS, TannerController
from defmanip_gym.errors import GainError
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.control_laws import ForceLoopGains
from defmanip_gym.theory.control.stability import SampledLoop
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH

GOAL = TaskParams().goal
GAINS = ForceLoopGains(k1=0.5, k2=2.0)


def predicted_growth(beam, assumed, believed, gains):
    """Return growth (1/s) and frequency (rad/s) of the loop's slowest oscillation."""
    task = TaskParams()
    matrix = SampledLoop(
        robot=RobotParams(),
        goal_pitch=JOINT_TO_PITCH @ np.array(GOAL[3:5]),
        beam=beam,
        linearization_beam=believed,
        force_law_damping=assumed,
        gains=gains,
        tracking_gain=GENTLE_PARAMS.tracking_gain,
        approach_rate=GENTLE_PARAMS.approach_rate,
        period_s=task.control_period_s,
    ).transition_matrix()
    eigenvalues = np.linalg.eigvals(matrix)
    dominant = eigenvalues[np.abs(eigenvalues).argmax()]
    return math.log(abs(dominant)) / task.control_period_s


def measured_growth(make_batch, beam, assumed, believed, gains, *, seconds=6.0):
    env = make_batch(beam=beam, nominal_beam=believed)
    params = replace(GENTLE_PARAMS, force_law_damping=assumed, gains=gains, feedforward=False)
    controller = TannerController(beam=beam, params=params, require_stability=False)
    observation, _ = env.reset(options={"start": (*GOAL[:5], 0.005)})
    memory, first, amplitudes = None, np.ones(1, bool), []
    for _ in range(round(seconds / 0.02)):
        action, memory = controller.predict(observation, memory, first)
        first = np.zeros(1, bool)
        observation, *_ = env.step(action)
        swing = controller.layout.part(observation, "swing")[0, 0]
        rate = controller.layout.part(observation, "swing_rate")[0, 0]
        amplitudes.append(math.hypot(4.93 * swing, rate))
    amplitudes = np.array(amplitudes)
    linear = amplitudes < 0.4
    end = len(linear) if linear.all() else linear.argmin()
    times = 0.02 * np.arange(end)
    settled = slice(min(75, end // 3), end)
    return np.polyfit(times[settled], np.log(amplitudes[settled]), 1)[0]


@pytest.mark.parametrize(
    ("assumed", "believed", "gains"),
    [
        (0.0, 0.1, GAINS),
        (1.0, 0.1, GAINS),
        (0.1, 0.1, ForceLoopGains(k1=0.2, k2=10.0)),
        (-0.1, 0.0, GAINS),
    ],
)
def test_swing_grows_or_decays_at_the_predicted_rate(make_batch, assumed, believed, gains):
    beam, believed = BeamParams(damping=0.1), BeamParams(damping=believed)
    predicted = predicted_growth(beam, assumed, believed, gains)
    measured = measured_growth(make_batch, beam, assumed, believed, gains)
    assert np.sign(measured) == np.sign(predicted)
    assert measured == pytest.approx(predicted, rel=0.15, abs=0.01)


def test_controller_refuses_the_gains_that_grow():
    params = replace(GENTLE_PARAMS, force_law_damping=1.0, gains=GAINS)
    with pytest.raises(GainError, match="spectral radius"):
        TannerController(beam=BeamParams(damping=0.1), params=params)
    TannerController(beam=BeamParams(damping=0.1), params=replace(GENTLE_PARAMS, gains=GAINS))
