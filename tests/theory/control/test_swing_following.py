import numpy as np

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.control.swing_following import SwingFollowing
from defmanip_gym.theory.payload.object_model import HangingBeam
from defmanip_gym.theory.payload.zero_dynamics import linearize


def test_following_takes_its_rate_times_mass_times_squared_speed_from_the_object():
    rng = np.random.default_rng(0)
    for count in (1, 4):
        beam = BeamParams(segment_count=count)
        swing, rate = rng.uniform(-0.5, 0.5, (2, 6, count))
        _, acceleration = SwingFollowing(linearize(beam), rate=2.0).motion(swing, rate)
        m_o12 = HangingBeam(beam).partition(swing, rate, np.zeros(6)).m_o12
        power = -np.einsum("nk,njk,nj->n", rate, m_o12, acceleration)
        np.testing.assert_allclose(power, -beam.mass_kg * acceleration[:, 0] ** 2 / 2.0, rtol=1e-12)
        assert (power < 0).all()


def test_the_acceleration_is_the_slope_of_the_velocity():
    rng, step = np.random.default_rng(1), 1e-6
    following = SwingFollowing(linearize(BeamParams(segment_count=3)), rate=1.5)
    swing, rate = rng.uniform(-0.5, 0.5, (2, 5, 3))
    (before, acceleration), (after, _) = (
        following.motion(swing + shift * rate, rate) for shift in (0.0, step)
    )
    np.testing.assert_allclose((after - before) / step, acceleration, atol=1e-5)
