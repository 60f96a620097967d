"""The regulator holds the object where its reference's acceleration would, and refuses nonsense."""

import gymnasium
import numpy as np
import pytest

from defmanip_gym.baselines.analytic.lqr import LqrController, LqrParams
from defmanip_gym.errors import ParameterError
from defmanip_gym.observation import ObservationLayout

ENV_ID = "defmanip_gym:DeformTransport-v0"


def test_a_swing_forwards_is_followed_forwards():
    observation, _ = gymnasium.make_vec(ENV_ID, num_envs=1).reset(options={"start": "paper"})
    swinging = observation.copy()
    ObservationLayout(1).part(swinging, "swing")[:] = 0.1
    controller = LqrController(params=LqrParams(acceleration_m_s2=1.0))
    at_rest, _ = controller.predict(observation)
    following, _ = controller.predict(swinging)
    assert following[0, 0] > at_rest[0, 0]
    np.testing.assert_allclose(following[0, 1:], at_rest[0, 1:])


def test_its_reference_starts_at_the_grasp_and_moves_on():
    observation, _ = gymnasium.make_vec(ENV_ID, num_envs=1).reset(options={"start": "paper"})
    controller, states = LqrController(), []
    _, state = controller.predict(observation)
    for _ in range(20):
        states.append(state)
        _, state = controller.predict(observation, state)
    travelled = np.hypot(*(states[-1][3] - states[0][3])[0, :2])
    assert 0.1 < travelled < 0.5


def test_wrong_choices_are_refused():
    with pytest.raises(ParameterError, match="acceleration_m_s2"):
        LqrParams(acceleration_m_s2=-1.0)
    with pytest.raises(ParameterError, match="observer_gain_per_s"):
        LqrParams(observer_gain_per_s=-1.0)
