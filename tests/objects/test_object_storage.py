"""The storage filter of objects from files: rods' numbers, σ kept on the rig, and refusals."""

import json
import math
import pickle

import numpy as np
import pytest

from defmanip_gym.errors import ActionError, CertificateError, ObjectFileError, ParameterError
from defmanip_gym.objects.mjcf_object import mjcf_object
from defmanip_gym.objects.object_filter_for import storage_error_on_rig, storing
from defmanip_gym.objects.rig_robot import RigRobot
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams
from defmanip_gym.plant.object_rig import ObjectRig
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH
from defmanip_gym.theory.filters.conditions import FilterConditions
from defmanip_gym.theory.filters.family import require_filter
from defmanip_gym.theory.filters.linkage_bounds import look
from defmanip_gym.theory.filters.object_filter import ObjectConditions, ObjectStorageFilter
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.rig_promise import RigPromise

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
QUIET = ObjectConditions(storage_error=0.003)


@pytest.fixture(scope="module")
def load(tmp_path_factory):
    def load(body, extra=""):
        path = tmp_path_factory.mktemp("object") / "object.xml"
        path.write_text(
            f"<mujoco><compiler angle='radian'/><worldbody>{body}</worldbody>{extra}</mujoco>"
        )
        return mjcf_object(path, grasp_site="grasp")

    return load


@pytest.fixture(scope="module")
def universal(load):
    return load(UNIVERSAL)


def made_for(thing, **options):
    return ObjectStorageFilter(thing.linkage(), mass_kg=thing.object_file.mass_kg, **options)


def rod(beam):
    across, along = beam.mass_kg * beam.length_m**2 / 12, beam.mass_kg * beam.radius_m**2 / 2
    return (
        f'<body><site name="grasp"/><body><joint name="swing" axis="0 -1 0"/>'
        f'<inertial pos="0 0 {-beam.length_m / 2}" mass="{beam.mass_kg}"'
        f' diaginertia="{across} {across} {along}"/></body></body>'
    )


def test_a_rod_in_a_file_gets_the_filter_of_the_rod(load):
    beam = BeamParams()
    made, rods = made_for(load(rod(beam))), StorageFilter(beam)
    assert made.pass_j == pytest.approx(rods.pass_j, rel=1e-6)
    rng = np.random.default_rng(0)
    swing, rate = rng.uniform(-0.5, 0.5, (200, 1)), rng.uniform(-2, 2, (200, 1))
    rows = np.zeros((200, ObservationLayout(1).size))
    part = ObservationLayout(1).part
    part(rows, "heading")[:, 1], part(rows, "joints")[:] = 1.0, (np.pi / 2, -np.pi / 2)
    part(rows, "swing")[:], part(rows, "swing_rate")[:] = swing, rate
    wished = rng.choice((-3.0, 3.0), (200, 3))
    allowed, levels = [], []
    for each in (made, rods):
        each.setup = each.setup._replace(levels=0.9 * each._model.passes)
        memory = each.memory(200)
        each.begin(memory, rows, np.ones(200, dtype=bool))
        levels.append(each.storage_shares(rows, memory))
        allowed.append(each.certify_action(wished, rows, memory).allowed_m_s2)
    # the file's object has its yaw inertia counted up by 2 %, and turning does not couple
    np.testing.assert_allclose(levels[0], levels[1], rtol=1e-6)
    np.testing.assert_allclose(allowed[0], allowed[1], atol=0.02)


def attacked(thing, made, *, side, count=64, steps=300, filtered=True):
    """Return promise and the largest |z2| / σ where it applies, under attackers on all axes."""
    robot = RigRobot(ObjectRig(thing.rig(), count=count, num_threads=1), made.setup.limits)
    rng = np.random.default_rng(1)
    pitch = np.tile(JOINT_TO_PITCH @ np.array(made.task.goal[3:5]), (count, 1))
    still = np.zeros(count)
    z2, rate, _ = storing(made, np.linspace(0, 0.999, count), still, rng)
    rows = robot.place(pitch, z2, rate)
    memory, every = made.memory(count), np.ones(count, dtype=bool)
    made.begin(memory, rows, every)
    promise = RigPromise(thing.linkage(), made.setup.limits, made, count)
    promise.begin(rows, memory, every)
    largest, part = np.zeros(count), robot.layout.part
    for _ in range(steps):
        coupling = look(made.setup.model, part(rows, "swing")).coupling
        momenta = np.einsum("nkj,nj->nk", coupling, part(rows, "swing_rate"))
        wished = -3.0 * np.sign(momenta[:, :3] + 1e-9) * [1.0, side, 0.3]
        if filtered:
            wished = made.certify_action(wished, rows, memory).allowed_m_s2
        rows = robot.step(wished, np.zeros((count, 3)))
        if filtered:
            promise.watch(made.conclude(rows, memory), rows, memory, None)
        share = robot.peak.max(axis=1) / made.sigma_rad
        largest = np.maximum(largest, np.where(promise.applies, share, 0.0))
    return promise, largest


@pytest.mark.parametrize("side", [0.0, 1.0])
def test_an_undamped_object_that_swings_in_two_directions_stays_within_sigma(universal, side):
    made = made_for(universal, conditions=QUIET)
    promise, largest = attacked(universal, made, side=side)
    assert promise.applies.mean() > 0.9
    assert 0.7 < largest.max() < 1.0
    _, without = attacked(universal, made, side=side, steps=80, filtered=False)
    assert without.max() > 1.0


def test_a_wish_that_stores_little_passes_unchanged(universal):
    made, layout = made_for(universal), ObservationLayout(2)
    rows = np.zeros((2, layout.size))
    layout.part(rows, "heading")[:, 1] = 1.0
    layout.part(rows, "joints")[:] = (math.pi / 2, -math.pi / 2)
    memory = made.memory(2)
    made.begin(memory, rows, np.ones(2, dtype=bool))
    wished = np.array([[2.0, -2.0, 1.0], [-1.0, 0.0, 0.5]])
    decision = made.certify_action(wished, rows, memory)
    np.testing.assert_array_equal(decision.allowed_m_s2, wished)
    assert (decision.margin > 0.5).all()


def test_who_turns_while_reversing_is_not_promised_anything(universal):
    made = made_for(universal)
    robot = RigRobot(ObjectRig(universal.rig(), count=2, num_threads=1), made.setup.limits)
    pitch = np.tile(JOINT_TO_PITCH @ np.array(made.task.goal[3:5]), (2, 1))
    still = np.zeros((2, 2))
    rows = robot.place(pitch, still, still, velocity_b=np.array([[-1.5, 0.3], [1.5, 0.3]]))
    assert made.inside(rows, made.memory(2)).tolist() == [False, True]


def test_steps_on_the_rig_are_foreseen(universal):
    made = made_for(universal, conditions=QUIET)
    assert 0 < storage_error_on_rig(universal, made) < QUIET.storage_error


def test_specification_and_pickle_make_it_again(universal):
    made = made_for(universal)
    again = require_filter("filter", json.loads(json.dumps(made.specification)))
    assert again == made and pickle.loads(pickle.dumps(made)) == made
    assert again.covers(universal.linkage()) and not again.covers(BeamParams())


def test_a_filter_for_another_object_does_not_apply(universal, load):
    heavier = load(UNIVERSAL.replace('mass="2"', 'mass="2.5"'))
    made = made_for(universal)
    promise = RigPromise(heavier.linkage(), made.setup.limits, made)
    assert "not computed for the object" in promise.configuration_reason
    with pytest.raises(CertificateError, match="1, as on the rig"):
        RigPromise(load(rod(BeamParams())).linkage(), made.setup.limits, made)
    assert (
        "late"
        in RigPromise(
            universal.linkage(), made.setup.limits, made, delay_periods=1
        ).configuration_reason
    )


def test_observations_and_wishes_of_another_size_are_refused(universal):
    made = made_for(universal)
    memory = made.memory(3)
    with pytest.raises(ParameterError, match="of 2 segments"):
        made.certify_action(np.zeros((3, 3)), np.zeros((3, ObservationLayout(1).size)), memory)
    rows = np.zeros((3, ObservationLayout(2).size))
    with pytest.raises(ActionError):
        made.certify_action(np.zeros((3, 2)), rows, memory)
    with pytest.raises(ParameterError, match="as the memory has episodes"):
        made.certify_action(np.zeros((2, 3)), rows[:2], memory)
    with pytest.raises(ParameterError, match="linkage"):
        ObjectStorageFilter("hose", mass_kg=1.0)
    with pytest.raises(ParameterError, match=r"linkage\.mass"):
        ObjectStorageFilter(universal.linkage()._replace(mass=np.ones(3)), mass_kg=1.0)


def test_sigma_beyond_the_pass_small_sigma_and_noise_are_refused(universal, load):
    standing = """<body><site name="grasp"/><body><joint name="j" axis="0 -1 0" stiffness="6.2"/>
      <inertial pos="0 0 0.3" mass="2" diaginertia="0.02 0.02 0.02"/></body></body>"""
    thing = load(standing)  # upright on a spring that is just strong enough: it falls from σ on
    assert made_for(thing, conditions=ObjectConditions(**EXACT), sigma_rad=0.6).level_share > 0
    softer = thing.linkage()._replace(stiffness=np.array([[5.87]]), preload=np.zeros(1))
    with pytest.raises(CertificateError, match="equilibrium|V_σ"):
        ObjectStorageFilter(softer, mass_kg=2.0, sigma_rad=0.6)
    with pytest.raises(CertificateError, match="errors, noise and delay"):
        made_for(universal, sigma_rad=0.01)
    with pytest.raises(CertificateError, match="swing_noise_rad"):
        ObjectConditions(swing_noise_rad=0.01)
    with pytest.raises(ParameterError, match="conditions"):
        made_for(universal, conditions=FilterConditions())


EXACT = {
    name: 0.0 for name in ObjectConditions.__dataclass_fields__ if name.endswith("error_m_s2")
} | {name: 0.0 for name in ObjectConditions.__dataclass_fields__ if "offset" in name}


def test_springs_that_links_do_not_have_are_refused(load):
    thing = load(
        """<body><site name="grasp"/><site name="hook" pos="0.1 0 0"/>
      <body><joint name="j" axis="0 -1 0"/><site name="eye" pos="0.1 0 -0.3"/>
      <inertial pos="0 0 -0.3" mass="2" diaginertia="0.02 0.02 0.02"/></body></body>""",
        extra="""<tendon><spatial stiffness="20" springlength="0.3"><site site="hook"/>
      <site site="eye"/></spatial></tendon>""",
    )
    with pytest.raises(ObjectFileError, match="force at rest"):
        thing.linkage()
