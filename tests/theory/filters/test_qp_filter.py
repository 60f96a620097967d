"""The reference filter by quadratic program, against brute force and in the environment."""

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.errors import (
    ActionError,
    CertificateError,
    ParameterError,
)
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.theory.control.control_laws import limit_speed
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.filters.barrier_rows import half_spaces_all
from defmanip_gym.theory.filters.conditions import PayloadIntervals
from defmanip_gym.theory.filters.decision import DecisionRoom
from defmanip_gym.theory.filters.qp_filter import CbfQpFilter, CbfQpParams
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.storage import StorageRoom, storage_at, swing_step

COUNT, A_MAX = 60, 3.0


@pytest.fixture(scope="module", autouse=True)
def daqp():
    return pytest.importorskip("daqp", reason="cbf_qp needs DAQP: pip install 'defmanip_gym[qp]'")


@pytest.fixture(scope="module")
def program():
    return CbfQpFilter()


def observations(count, segments=1, seed=0, rate=3.0):
    """States on both sides of all limits."""
    rng, layout = np.random.default_rng(seed), ObservationLayout(segments)
    observed = np.zeros((count, layout.size))
    for name, spread in (
        ("grasp_velocity_b", 1.2),
        ("base_velocity", 1.0),
        ("joint_rates", 0.5),
        ("swing", 0.45),
        ("swing_rate", rate),
    ):
        part = layout.part(observed, name)
        part[...] = rng.uniform(-spread, spread, part.shape)
    layout.part(observed, "joints")[...] = (1.4, -1.3) + rng.uniform(-0.3, 0.3, (count, 2))
    layout.part(observed, "heading")[:, 1] = 1.0
    return observed, rng.uniform(-A_MAX, A_MAX, (count, 3))


def half_spaces(made, wished, sensed):
    rows = len(made.setup.levels) + 1
    slopes, bounds = np.empty((len(wished), rows, 3)), np.empty((len(wished), rows))
    limited, excess, margin = np.empty_like(wished), *np.empty((2, len(wished)))
    half_spaces_all(
        made.setup,
        made.params.gamma_per_s,
        *(wished, sensed, DecisionRoom.empty(made.segment_count)),
        *(slopes, bounds, limited, excess, margin),
    )
    return slopes, bounds, excess, margin


def allowed_by(made, wished, observed):
    memory = made.memory(len(observed))
    made.begin(memory, observed, np.ones(len(observed), bool))
    return made.certify_action(wished, observed, memory)


@pytest.mark.parametrize("segments", [1, 3])
def test_a_barriers_half_space_is_the_derivative_of_b(segments):
    """B along the object's own motion under w, over a microsecond."""
    made = CbfQpFilter(BeamParams(segment_count=segments))
    observed, wished = observations(20, segments)
    sensed = Sensed.observed(ObservationLayout(segments), observed)
    slopes, bounds, _, margin = half_spaces(made, wished, sensed)
    redundancy = RedundancyResolution(RobotParams(), goal_reach_m=0.7)
    turning = redundancy.accelerations(
        wished, sensed.pitch, sensed.pitch_rate, sensed.base_velocity
    )[:, 1]
    step, room, model = 1e-6, StorageRoom.empty(segments), made.setup.model
    for i in range(20):
        u2 = sensed.base_velocity[i, 1]
        before = storage_at(model, 0, sensed.swing[i], sensed.swing_rate[i], u2, room)
        swing_step(
            model,
            0,
            sensed.swing[i],
            sensed.swing_rate[i],
            *(wished[i, 0], wished[i, 2], u2 + step / 2 * turning[i], step),
            room,
        )
        later = room.swing.copy(), room.swing_rate.copy()
        after = storage_at(model, 0, *later, u2 + step * turning[i], room)
        growth = (after - before) / step / made.pass_j
        condition = slopes[i, 0] @ wished[i] - bounds[i, 0]
        assert condition == pytest.approx(
            growth - made.params.gamma_per_s * margin[i], rel=1e-3, abs=1e-3
        )


@pytest.mark.parametrize("length", [(1.0, 1.0), (0.8, 1.2)])
def test_no_command_that_is_drawn_is_nearer_and_allowed(length):
    made = CbfQpFilter(intervals=PayloadIntervals(length=length))
    observed, wished = observations(COUNT)
    wished *= 1.3
    decision = allowed_by(made, wished, observed)
    slopes, bounds, _, _ = half_spaces(
        made, wished, Sensed.observed(ObservationLayout(1), observed)
    )
    velocity = ObservationLayout(1).part(observed, "grasp_velocity_b")
    wanted = limit_speed(wished, velocity, 2.0, 0.02)
    rng, changed = np.random.default_rng(1), 0

    def cost(w, i):
        beyond = w @ slopes[i].T - bounds[i]
        slack = np.maximum(beyond[:, :-1].max(axis=1), 0.0)
        outside = (np.abs(w).max(axis=1) > A_MAX + 1e-6) | (beyond[:, -1] > 1e-6)
        total = ((w - wanted[i]) ** 2).sum(axis=1) + made.params.slack_weight * slack**2
        return np.where(outside, np.inf, total)

    for i in range(COUNT):
        found = decision.allowed_m_s2[i]
        if np.array_equal(found, wished[i]):  # the robot will do what is left of it
            found = wanted[i]
        own = cost(found[None], i)[0]
        changed += not np.array_equal(found, wanted[i])
        spread = 10.0 ** rng.uniform(-4, 0.8, (20000, 1))
        near = np.clip(found + spread * rng.normal(size=(20000, 3)), -A_MAX, A_MAX)
        assert own <= cost(near, i).min() + 1e-4
    assert 10 < changed


def test_wishes_pass_as_they_are_where_nothing_binds(program):
    observed, wished = observations(500)
    sensed = Sensed.observed(ObservationLayout(1), observed)
    excess = half_spaces(program, wished, sensed)[2]
    decision = allowed_by(program, wished, observed)
    same = (decision.allowed_m_s2 == wished).all(axis=1)
    assert (same == (excess <= 1e-9)).all()
    assert 50 < same.sum() < 450


def test_who_wants_to_be_faster_than_the_limit_is_left_to_the_limiter(program):
    observed, _ = observations(20, rate=0.0)
    ObservationLayout(1).part(observed, "grasp_velocity_b")[:] = (2.0, 0.0, 0.0)
    wished = np.tile((3.0, 0.0, 0.0), (20, 1))
    assert np.array_equal(allowed_by(program, wished, observed).allowed_m_s2, wished)


def test_a_decision_does_not_depend_on_its_batch(program):
    observed, wished = observations(COUNT)
    together = allowed_by(program, wished, observed)
    alone = [allowed_by(program, wished[i : i + 1], observed[i : i + 1]) for i in range(COUNT)]
    assert np.array_equal(together.allowed_m_s2, np.concatenate([d.allowed_m_s2 for d in alone]))
    assert np.array_equal(together.margin, np.concatenate([d.margin for d in alone]))


def test_beyond_the_level_it_damps_and_says_so(program):
    layout = ObservationLayout(1)
    observed, _ = observations(1)
    layout.part(observed, "grasp_velocity_b")[:] = layout.part(observed, "base_velocity")[:] = 0.0
    layout.part(observed, "swing")[:], layout.part(observed, "swing_rate")[:] = 0.1, 4.0
    decision = allowed_by(program, np.array([[-3.0, 0.0, 0.0]]), observed)
    assert decision.margin[0] < 0
    assert decision.allowed_m_s2[0, 0] > 1.0
    layout.part(observed, "swing_rate")[:] = 6.0  # more than can be damped at that rate
    decision = allowed_by(program, np.array([[-3.0, 0.0, 0.0]]), observed)
    assert decision.allowed_m_s2[0, 0] == pytest.approx(A_MAX, abs=0.01)


def test_nothing_is_faster_ahead_than_the_limit_not_even_beyond_the_level(program):
    observed, wished = observations(500, rate=9.0)
    velocity = ObservationLayout(1).part(observed, "grasp_velocity_b")
    heading = velocity / np.linalg.norm(velocity, axis=1)[:, None]
    velocity[:] = 1.99 * heading
    decision = allowed_by(program, wished, observed)
    realized = np.where(
        (decision.allowed_m_s2 == wished).all(axis=1)[:, None],
        limit_speed(wished, velocity, 2.0, 0.02),
        decision.allowed_m_s2,
    )
    ahead = (heading * (velocity + 0.02 * realized)).sum(axis=1)
    assert (decision.margin < 0).sum() > 200
    assert ahead.max() == pytest.approx(2.0, abs=1e-6)


def test_a_grasp_above_the_speed_limit_may_brake_gently(program):
    observed, _ = observations(20, rate=0.0)
    ObservationLayout(1).part(observed, "grasp_velocity_b")[:] = (2.5, 0.0, 0.0)
    wished = np.tile((-0.5, 0.0, 0.0), (20, 1))
    decision = allowed_by(program, wished, observed)
    assert (decision.margin > 0).all()
    assert np.array_equal(decision.allowed_m_s2, wished)


def pumped(made, *, axes, hold, steps=300, count=64):
    """Swing over σ and B over its level, at worst, of episodes that go on."""
    env = DeformTransportVectorEnv(
        count, constraint_mode="cost", autoreset_mode=AutoresetMode.DISABLED
    )
    layout, rng = ObservationLayout(1), np.random.default_rng(0)
    observed, _ = env.reset(seed=0)
    memory = made.memory(count)
    made.begin(memory, observed, np.ones(count, bool))
    alive, swings, shares = np.ones(count, bool), [], []
    for step in range(steps):
        if step % hold == 0:
            corner = rng.choice((-1.0, 1.0), (count, 3)) * axes
        wished = A_MAX * corner
        wished[:, 0] = -A_MAX * np.sign(layout.part(observed, "swing_rate")[:, 0])
        decision = made.certify_action(wished, observed, memory)
        observed, _, terminated, _, _ = env.step(decision.allowed_m_s2 / A_MAX)
        made.conclude(observed, memory)
        alive &= ~terminated
        if not alive.any():
            break
        swings.append(np.abs(layout.part(observed, "swing"))[alive].max())
        shares.append(made.storage_shares(observed, memory)[alive].max())
    env.close()
    return max(swings) / made.sigma_rad, max(shares)


def test_pumping_forward_stays_below_the_level(program):
    swing, share = pumped(program, axes=(1, 0, 0), hold=60)
    assert 0.85 < swing < 1.0
    assert 0.8 < share <= 1.0


def test_pumping_with_the_arm_at_its_limits_exceeds_the_level_but_not_sigma(program):
    """What the arm does at its limits is foreseen by ``storage``, not by this filter."""
    swing, share = pumped(program, axes=(1, 1, 1), hold=15)
    assert swing < 1.0
    assert share > 1.0


def test_a_smaller_gamma_keeps_farther_away():
    swings = [
        pumped(CbfQpFilter(params=CbfQpParams(gamma_per_s=gamma)), axes=(1, 0, 0), hold=60)[0]
        for gamma in (0.5, 5.0, 50.0)
    ]
    assert swings[0] < swings[1] - 0.02 and swings[1] < swings[2] - 0.01


def test_wishes_however_large_end_in_the_box(program):
    observed, wished = observations(COUNT)
    decision = allowed_by(program, 1e300 * wished, observed)
    assert np.abs(decision.allowed_m_s2).max() <= A_MAX


def test_bad_input_is_refused(program):
    observed, wished = observations(2)
    with pytest.raises(ActionError, match="wished"):
        allowed_by(program, wished * np.nan, observed)
    with pytest.raises(ParameterError, match="observation"):
        allowed_by(program, wished, observed[:, :-1])
    with pytest.raises(ParameterError, match="gamma_per_s"):
        CbfQpParams(gamma_per_s=0.0)
    with pytest.raises(ParameterError, match="params"):
        CbfQpFilter(params=5.0)
    with pytest.raises(CertificateError, match="share of V_σ"):
        CbfQpFilter(sigma_rad=0.01)
