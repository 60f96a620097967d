import numpy as np
import pytest

from defmanip_gym.params import BeamParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.theory.certificates.certified_command import certified_command
from defmanip_gym.theory.control.control_laws import limit_speed

MAX_SPEED, PERIOD_S, REACH = 2.0, 0.02, 0.8


@pytest.mark.parametrize("damping", [0.1, 1.0])
def test_speed_limit_downstream_leaves_certified_commands_alone(damping):
    """The environment limits the speed after the wrapper; that must not break the bounds."""
    certificate = certify(BeamParams(damping=damping), conditions=TRANSPORT_CONDITIONS)
    rng = np.random.default_rng(0)
    velocity, w = np.zeros((50, 3)), np.zeros((50, 3))
    reach = np.full(50, REACH)
    for k in range(1500):
        if k % 10 == 0:
            w = rng.uniform(-3, 3, (50, 3))
            w[:, 0] = np.abs(w[:, 0])  # as fast as it gets
        # lifting by half a metre within the vertical bound is no faster than this
        w[:, 2] = np.where(np.abs(velocity[:, 2]) > 0.15, -np.sign(velocity[:, 2]), w[:, 2])
        yaw_rate = velocity[:, 1] / REACH
        base_velocity = np.stack((velocity[:, 0], yaw_rate), axis=1)
        certified = certified_command(
            w,
            velocity,
            base_velocity,
            reach,
            certificate,
            disturbance=np.zeros((50, 3)),
            max_speed=MAX_SPEED,
            period_s=PERIOD_S,
        )
        assert np.abs(certified[:, 0]).max() <= certificate.acceleration_bound
        assert np.abs(certified[:, 2]).max() <= certificate.vertical_acceleration_bound
        limited = limit_speed(certified, velocity, MAX_SPEED, PERIOD_S)
        np.testing.assert_allclose(limited, certified, atol=1e-9)
        turning = np.stack((yaw_rate * velocity[:, 1], -yaw_rate * velocity[:, 0], 0 * reach), 1)
        velocity = velocity + PERIOD_S * (limited + turning)
    assert np.linalg.norm(velocity, axis=1).max() > 1.8
    assert np.abs(yaw_rate).max() <= certificate.conditions.yaw_rate_rad_s + 1e-3
