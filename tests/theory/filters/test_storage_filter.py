"""The storage filter by itself: what it lets pass, what it asks for, and what it refuses."""

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from defmanip_gym.errors import ActionError, CertificateError, ParameterError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.filters.conditions import FilterConditions, PayloadIntervals
from defmanip_gym.theory.filters.family import require_filter
from defmanip_gym.theory.filters.storage_filter import StorageFilter

JOINTS = (math.pi / 2, -math.pi / 2)
EXACT = FilterConditions(
    forward_error_m_s2=0.0, lateral_error_m_s2=0.0, vertical_error_m_s2=0.0, storage_error=0.0
)


def observation(swing, rate, *, velocity=0.0, yaw_rate=0.0):
    """Return observations (n, size) of robots with bent arms that drive straight ahead."""
    swing, rate = np.atleast_2d(swing), np.atleast_2d(rate)
    layout = ObservationLayout(swing.shape[1])
    rows = np.zeros((len(swing), layout.size))
    layout.part(rows, "heading")[:, 1] = 1.0
    layout.part(rows, "joints")[:] = JOINTS
    layout.part(rows, "swing")[:], layout.part(rows, "swing_rate")[:] = swing, rate
    layout.part(rows, "grasp_velocity_b")[:, 0] = velocity
    layout.part(rows, "base_velocity")[:, 0] = velocity
    layout.part(rows, "base_velocity")[:, 1] = yaw_rate
    layout.part(rows, "grasp_velocity_b")[:, 1] = 0.7 * np.asarray(yaw_rate)
    return rows


def decided(made, wished, rows):
    memory = made.memory(len(rows))
    made.begin(memory, rows, np.ones(len(rows), dtype=bool))
    return made.certify_action(wished, rows, memory)


def at_the_level(made, shares, seed=0, count=200):
    """Return swings and rates (n, N) whose storage is a share of the level."""
    rng = np.random.default_rng(seed)
    swing, rate = rng.normal(size=(2, count, made.segment_count))
    rate *= 5.0
    factor = np.full((count, 1), 0.1)
    for _ in range(60):
        stored = made.shares_of(factor * swing, factor * rate, np.zeros(count))
        factor *= np.sqrt(shares / np.maximum(stored, 1e-12))[:, None].clip(0.5, 2.0)
    return factor * swing, factor * rate


def test_far_from_the_level_every_wish_passes_unchanged():
    made = StorageFilter()
    wished = np.array([[3.0, -3.0, 3.0], [-3.0, 3.0, -2.0], [0.1, 0.2, 0.3]])
    decision = decided(made, wished, observation(np.zeros((3, 1)), np.zeros((3, 1))))
    np.testing.assert_array_equal(decision.allowed_m_s2, wished)
    assert (decision.margin > 0.5).all()


def test_a_push_with_the_swing_is_turned_into_one_against_it():
    made = StorageFilter()
    rate = made.edge()[1].max() * np.array([[1.0], [-1.0]])
    wished = np.array([[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    allowed = decided(made, wished, observation(np.zeros((2, 1)), rate)).allowed_m_s2
    assert (allowed[:, 0] * rate[:, 0] > 0).all()
    assert np.abs(allowed[:, 0]).max() < 1.0  # no more than errors ask for


@pytest.mark.parametrize("segments", [1, 2, 5])
def test_what_is_allowed_keeps_the_foreseen_storage_below_the_level(segments):
    made = StorageFilter(BeamParams(segment_count=segments, damping=0.0), conditions=EXACT)
    swing, rate = at_the_level(made, 0.99)
    rows = observation(swing, rate)
    rng = np.random.default_rng(1)
    decision = decided(made, rng.choice((-3.0, 3.0), (len(rows), 3)), rows)
    assert (decision.margin >= -1e-9).all()


def test_it_changes_no_more_than_it_must():
    """A command a tenth nearer to the wish is refused, but for a few beside σ, where s is small."""
    made = StorageFilter(conditions=EXACT)
    rows = observation(*at_the_level(made, 0.998))
    wished = np.tile([0.0, 0.0, 0.0], (len(rows), 1))
    wished[:, 0] = -3.0 * np.sign(ObservationLayout(1).part(rows, "swing_rate")[:, 0])
    allowed = decided(made, wished, rows).allowed_m_s2
    changed = np.abs(allowed - wished).max(axis=1) > 1e-6
    assert changed.sum() > 20
    nearer = (allowed + 0.1 * (wished - allowed))[changed]
    again = decided(made, nearer, rows[changed]).allowed_m_s2
    assert (np.abs(again - nearer).max(axis=1) > 1e-6).mean() > 0.97


def test_at_the_speed_limit_it_chooses_what_the_limiter_leaves_alone():
    made = StorageFilter()
    swing, rate = at_the_level(made, 1.0)
    rows = observation(swing, rate, velocity=np.where(np.arange(len(swing)) % 2, 2.0, -2.0))
    allowed = decided(made, np.full((len(rows), 3), 3.0), rows).allowed_m_s2
    changed = (allowed != 3.0).any(axis=1)
    ahead = ObservationLayout(1).part(rows, "grasp_velocity_b") + 0.02 * allowed
    assert changed.sum() > 20
    assert np.linalg.norm(ahead[changed], axis=1).max() <= 2.0 + 1e-9


def test_fast_turning_leaves_the_drive_less_to_push_with():
    made = StorageFilter()
    rows = observation([[0.0]], [[0.0]], yaw_rate=np.array([2.6]))
    allowed = decided(made, [[3.0, 0.0, 0.0]], rows).allowed_m_s2
    assert 0 <= allowed[0, 0] < 2.1


def test_more_room_for_errors_lowers_the_level():
    shares = [
        StorageFilter(conditions=conditions).level_share
        for conditions in (
            EXACT,
            FilterConditions(),
            FilterConditions(delay_periods=3),
            FilterConditions(forward_error_m_s2=1.0),
        )
    ]
    assert shares == sorted(shares, reverse=True) and shares[0] > 0.97


def test_any_damping_is_covered_and_other_beams_within_the_intervals_only():
    beam = BeamParams()
    exact = StorageFilter(beam)
    assert exact.covers(replace(beam, damping=0.0)) and exact.covers(replace(beam, damping=9.0))
    assert not exact.covers(replace(beam, length_m=0.61))
    wide = StorageFilter(beam, intervals=PayloadIntervals(mass=(0.8, 1.2), length=(0.8, 1.2)))
    assert wide.covers(replace(beam, length_m=0.48, mass_kg=1.2 * beam.mass_kg))
    assert not wide.covers(replace(beam, length_m=0.8))
    assert not wide.covers(BeamParams(segment_count=2))


def test_over_intervals_the_storage_of_every_beam_stays_below_its_pass():
    beam = BeamParams(segment_count=2, root_stiffness=2.0)
    intervals = PayloadIntervals(mass=(0.8, 1.2), length=(0.9, 1.1), stiffness=(0.7, 1.5))
    wide = StorageFilter(beam, intervals=intervals, conditions=EXACT)
    swing, rate = at_the_level(wide, 1.0)
    rng = np.random.default_rng(3)
    for _ in range(20):
        mass, length, stiffness, _ = (rng.uniform(*ends) for ends in vars(intervals).values())
        carried = replace(
            beam,
            mass_kg=mass * beam.mass_kg,
            length_m=length * beam.length_m,
            root_stiffness=stiffness * beam.root_stiffness,
            joint_stiffness=stiffness * beam.joint_stiffness,
        )
        own = StorageFilter(carried, conditions=EXACT)
        assert own.shares_of(swing, rate, np.zeros(len(swing))).max() <= 1.0 + 1e-6


def test_a_filter_is_made_again_from_its_specification():
    made = StorageFilter(
        BeamParams(segment_count=2),
        conditions=FilterConditions(swing_noise_rad=0.001),
        intervals=PayloadIntervals(mass=(0.9, 1.1)),
    )
    again = require_filter("safety_filter", made.specification)
    assert again == made and hash(again) == hash(made)
    assert again.level_share == made.level_share
    assert StorageFilter() != made


def test_errors_that_leave_nothing_are_refused_with_the_remedy():
    with pytest.raises(CertificateError, match="larger sigma_rad or smaller errors"):
        StorageFilter(conditions=FilterConditions(forward_offset_m_s2=30.0))


@pytest.mark.parametrize(
    "arguments",
    [
        {"forward_error_m_s2": -0.1},
        {"delay_periods": 1.5},
        {"swing_noise_rad": math.nan},
        {"storage_error": "much"},
    ],
)
def test_conditions_that_cannot_be_are_refused(arguments):
    with pytest.raises(ParameterError, match=next(iter(arguments))):
        FilterConditions(**arguments)


def test_intervals_lie_around_the_believed_beam():
    with pytest.raises(ParameterError, match="around 1"):
        PayloadIntervals(mass=(1.1, 1.2))


@pytest.mark.parametrize("wished", [[[math.nan, 0, 0]], [[1, 2]], "fast", [[1, 2, 3]] * 2])
def test_wishes_that_are_none_get_our_error(wished):
    made = StorageFilter()
    with pytest.raises(ActionError, match="wished acceleration"):
        decided(made, wished, observation([[0.0]], [[0.0]]))


def test_observations_of_another_size_get_our_error():
    made = StorageFilter()
    rows = observation([[0.0, 0.0]], [[0.0, 0.0]])
    with pytest.raises(ParameterError, match="of 1 segments"):
        made.certify_action([[0.0, 0.0, 0.0]], rows, made.memory(1))


def test_a_specification_of_something_else_is_refused():
    for value in (None, {"name": "stowage"}, {"beam": {}}, {"name": "storage", "colour": 1}):
        with pytest.raises(ParameterError):
            require_filter("safety_filter", value)


def test_errors_survive_pickling():
    with pytest.raises(CertificateError) as caught:
        StorageFilter(conditions=FilterConditions(forward_offset_m_s2=30.0))
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_another_control_period_makes_another_filter():
    slow = StorageFilter(task=TaskParams(control_period_s=0.04))
    assert slow.level_share < StorageFilter().level_share


def test_a_delay_and_an_interval_of_length_are_not_covered_together():
    """Attackers reached 1.2 σ: commands under way are foreseen with one beam."""
    late, wide = FilterConditions(delay_periods=3), PayloadIntervals(length=(0.5, 1.0))
    with pytest.raises(CertificateError, match="known exactly"):
        StorageFilter(conditions=late, intervals=wide)
    StorageFilter(conditions=late, intervals=PayloadIntervals(mass=(0.5, 1.5)))


def test_no_command_is_lost_by_rounding():
    """An axis at the largest acceleration may exceed it in the last digit; it is not dropped."""
    made = StorageFilter(conditions=EXACT)
    swing, rate = at_the_level(made, 0.999, count=4000)
    rows = observation(swing, rate)
    wished = np.random.default_rng(5).choice((-3.0, 3.0), (len(rows), 3))
    decision = decided(made, wished, rows)
    again = decided(made, decision.allowed_m_s2, rows)
    assert (again.margin > -1e-6).all()
    assert np.abs(decision.allowed_m_s2).max() <= 3.0


def test_memories_of_another_number_of_episodes_get_our_error():
    made = StorageFilter()
    rows = observation([[0.0]] * 3, [[0.0]] * 3)
    for wrong in (
        lambda m: made.certify_action(np.zeros((3, 3)), rows, m),
        lambda m: made.conclude(rows, m),
        lambda m: made.begin(m, rows, np.ones(3, dtype=bool)),
    ):
        with pytest.raises(ParameterError, match="as the memory has episodes"):
            wrong(made.memory(2))
    with pytest.raises(ParameterError, match="count"):
        made.memory(-1)
