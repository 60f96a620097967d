"""Programs keep to swing, acceleration and speed, and stay solvable where the swing is beyond."""

import sys

import numpy as np
import pytest

from defmanip_gym.errors import InstallationError
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.control.horizon import HorizonStart, HorizonWeights
from defmanip_gym.theory.control.prediction import HORIZON_BLOCKS, Prediction
from defmanip_gym.theory.control.receding_horizon import HorizonProgram
from defmanip_gym.theory.payload.zero_dynamics import linearize

PREDICTION = Prediction(linearize(BeamParams()), HORIZON_BLOCKS, 0.02)
SIGMA, LARGEST = 0.3, 2.5


def program(weights=HorizonWeights()):  # noqa: B008
    pytest.importorskip("daqp", reason="mpc needs DAQP: pip install 'defmanip_gym[qp]'")
    return HorizonProgram(
        PREDICTION, weights, sigma_rad=SIGMA, acceleration_m_s2=LARGEST, heading_rad=0.1
    )


def start(*, velocity=(0.0, 0.0), swing=(0.0, 0.0), goal=(5.0, 0.0), heading=0.0):
    """Return one episode at the origin of axes whose goal lies at ``goal``."""
    blocks = len(HORIZON_BLOCKS)
    plan, velocity = np.zeros((1, blocks, 2)), np.array([velocity])
    forecast = PREDICTION.courses(np.array([heading]), velocity, plan, np.array([0.7]))
    return HorizonStart(
        position=np.zeros((1, 2)),
        velocity=velocity,
        swing=np.array([swing]),
        reference=np.tile(np.array(goal), (1, blocks, 1)),
        reference_velocity=np.zeros((1, blocks, 2)),
        headings=forecast,
        courses=np.full((1, blocks), np.arctan2(goal[1], goal[0])),
        speed_limit=np.array([1.5]),
        plan=plan,
    )


def predicted(plan, now):
    """Return swing angles and forward speeds of a plan straight ahead, (M,) each."""
    forward = plan[0, :, 0]
    swing = PREDICTION.swing[:, 0] @ forward + PREDICTION.free_swing[:, 0] @ now.swing[0]
    return swing, now.velocity[0, 0] + PREDICTION.velocity @ forward


def test_a_plan_goes_as_far_as_its_limits_let_it():
    now = start()
    plan, found = program().solve(now)
    swing, speed = predicted(plan, now)
    assert found.all()
    assert np.abs(swing).max() == pytest.approx(SIGMA, abs=1e-4)
    assert np.abs(plan).max() <= LARGEST + 1e-9
    assert speed.max() == pytest.approx(1.5, abs=1e-4)


def test_a_swing_beyond_its_limit_is_brought_back():
    now = start(swing=(0.5, 0.0), goal=(0.01, 0.0))
    plan, found = program().solve(now)
    swing, _ = predicted(plan, now)
    assert found.all() and np.abs(swing[PREDICTION.times_s > 0.7]).max() < SIGMA + 1e-3


def test_near_the_goal_a_wrong_heading_is_worth_a_detour():
    now = start(goal=(0.2, 0.0), heading=0.5, velocity=(0.3, 0.0))
    turned, straight = (
        program(HorizonWeights(heading=weight)).solve(now)[0] for weight in (30.0, 0.0)
    )
    to_left = PREDICTION.mean_velocity @ (turned - straight)[0, :, 1]
    assert to_left.min() < -0.05  # that turns the base to the right


def test_without_its_solver_it_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "daqp", None)  # as if it were not installed
    with pytest.raises(InstallationError, match=r"mpc needs.*defmanip_gym\[qp\]"):
        HorizonProgram(
            PREDICTION,
            HorizonWeights(),
            sigma_rad=SIGMA,
            acceleration_m_s2=LARGEST,
            heading_rad=0.1,
        )
