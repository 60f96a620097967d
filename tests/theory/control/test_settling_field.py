"""Near the goal the way is straight, from afar it is the field's."""

import numpy as np
import pytest

from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.control.settling_field import SettlingField
from defmanip_gym.theory.control.velocity_field import NormalizedField

FIELD = NormalizedField(
    max_speed_m_s=1.9,
    deceleration_m_s2=1.5,
    vertical_deceleration_m_s2=1.0,
    approach_rate_per_s=3.0,
)
SETTLING = SettlingField(field=FIELD, radius_m=0.2)


def test_beside_the_goal_it_leads_there_and_not_along_the_streamline():
    beside = np.array([0.0, 0.02, 0.1])
    streamline, straight = FIELD.velocity(beside), SETTLING.velocity(beside)
    assert abs(streamline[0]) > 0.9 * np.hypot(*streamline[:2])
    assert straight[1] < -0.9 * np.hypot(*straight[:2])
    assert straight[2] == streamline[2]


def test_from_afar_it_is_the_field():
    afar = np.array([[-8.5, 5.5, -0.4], [6.0, -9.0, 0.0]])
    np.testing.assert_allclose(SETTLING.velocity(afar), FIELD.velocity(afar), atol=0.01)


def test_it_is_never_faster_than_the_field_and_rests_at_the_goal():
    around = np.random.default_rng(0).normal(scale=0.3, size=(100, 3))
    faster = np.linalg.norm(SETTLING.velocity(around), axis=1)
    assert (faster <= np.linalg.norm(FIELD.velocity(around), axis=1) + 1e-12).all()
    np.testing.assert_array_equal(SETTLING.velocity(np.zeros(3)), np.zeros(3))


def test_a_radius_is_positive():
    with pytest.raises(ParameterError, match="radius_m"):
        SettlingField(field=FIELD, radius_m=0.0)
