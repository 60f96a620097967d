"""The storage of objects from files: the theory's numbers for rods, and σ kept under attack."""

import math

import numpy as np
import pytest

from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.objects.mjcf_object import mjcf_object
from defmanip_gym.objects.object_storage import ObjectStorage
from defmanip_gym.params import BeamParams
from defmanip_gym.plant.object_rig import ObjectRig
from defmanip_gym.theory.filters.storage import StorageModel, StorageRoom, lowest_pass, storage_at

SIGMA = math.pi / 6
UNIVERSAL = """
<body><site name="grasp"/>
  <body>
    <joint name="pitch" axis="0 -1 0"/>
    <inertial pos="0 0 -0.001" mass="0.01" diaginertia="1e-5 1e-5 1e-5"/>
    <body>
      <joint name="roll" axis="1 0 0"/>
      <inertial pos="0 0 -0.3" mass="2" diaginertia="0.06 0.06 0.001"/>
    </body>
  </body>
</body>
"""


@pytest.fixture
def load(tmp_path):
    def load(body):
        path = tmp_path / "object.xml"
        path.write_text(f"<mujoco><compiler angle='radian'/><worldbody>{body}</worldbody></mujoco>")
        return mjcf_object(path, grasp_site="grasp")

    return load


def rod(beam):
    across, along = beam.mass_kg * beam.length_m**2 / 12, beam.mass_kg * beam.radius_m**2 / 2
    return (
        f'<body><site name="grasp"/><body><joint name="swing" axis="0 -1 0"/>'
        f'<inertial pos="0 0 {-beam.length_m / 2}" mass="{beam.mass_kg}"'
        f' diaginertia="{across} {across} {along}"/></body></body>'
    )


def test_a_rod_in_a_file_stores_what_the_theorys_does(load):
    beam = BeamParams()
    made = ObjectStorage(load(rod(beam)))
    assert made.pass_j == pytest.approx(lowest_pass(beam, SIGMA)[0], rel=1e-6)
    model, room = StorageModel.of((beam,), SIGMA), StorageRoom.empty(1)
    for swing, rate, yaw_rate in ((0.2, 1.0, 0.0), (-0.4, 0.3, 1.5), (0.1, -2.0, -0.7)):
        theory = storage_at(model, 0, np.array([swing]), np.array([rate]), yaw_rate, room)
        stored = made.stored([swing], [rate], yaw_rate)
        assert stored.energy_j == pytest.approx(theory, rel=1e-6)
        assert stored.momentum[0] == pytest.approx(model.moments[0, 0] * np.cos(swing) * rate)


def attacked(loaded, made, *, yaw_rate, seconds=12.0, filtered=True):
    """Return the largest coordinate under an attacker that feeds the storage on all axes."""
    rig = ObjectRig(loaded.rig(timestep_s=0.002), count=1)

    def command(time_s, z2, z2_rate):
        turning = yaw_rate * min(time_s, 1.0)
        wished = -3.0 * np.sign(made.stored(z2[0], z2_rate[0], turning).momentum + 1e-9)
        if filtered:
            wished = made.allowed(wished, z2[0], z2_rate[0], turning)
        return np.array([[*wished, turning]])

    return float(rig.shake(command, duration_s=seconds, hold_steps=10).peak.max())


@pytest.mark.parametrize("yaw_rate", [0.0, 0.8])
def test_an_undamped_object_that_swings_in_two_directions_stays_within_sigma(load, yaw_rate):
    loaded = load(UNIVERSAL)
    made = ObjectStorage(loaded)
    largest = attacked(loaded, made, yaw_rate=yaw_rate)
    assert 0.7 * SIGMA < largest < SIGMA
    assert attacked(loaded, made, yaw_rate=yaw_rate, seconds=4.0, filtered=False) > SIGMA


def test_far_from_the_level_accelerations_pass(load):
    made = ObjectStorage(load(UNIVERSAL))
    wished = np.array([3.0, -3.0, 1.0])
    np.testing.assert_array_equal(made.allowed(wished, [0.0, 0.0], [0.0, 0.0]), wished)


def test_the_lowest_pass_is_named(load):
    made = ObjectStorage(load(UNIVERSAL))
    assert made.coordinate in ("pitch", "roll") and 0 < made.level_j < made.pass_j


def test_states_of_another_size_and_hopeless_periods_are_refused(load):
    loaded = load(UNIVERSAL)
    with pytest.raises(ParameterError, match="z2"):
        ObjectStorage(loaded).stored([0.1], [0.0, 0.0])
    with pytest.raises(CertificateError, match="shorter period"):
        ObjectStorage(loaded, period_s=0.9)
