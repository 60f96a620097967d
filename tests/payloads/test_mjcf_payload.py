"""Objects from files are carried as rods are: same faces, same controllers, errors that help."""

import pickle
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import defmanip_gym.objects
from defmanip_gym.baselines.analytic.field import make_controller
from defmanip_gym.baselines.analytic.lqr import make_controller as make_lqr
from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.envs.state import get_state, set_state
from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.errors import ObjectFileError, ParameterError, PayloadError, StartError
from defmanip_gym.params import BeamParams
from defmanip_gym.payloads.mjcf import MjcfPayload
from defmanip_gym.payloads.rod import RodPayload

EXAMPLES = Path(defmanip_gym.objects.__file__).parent / "examples"
NAMES = ("bucket", "hose", "spherical")
FELT = {"inner_loop": "measured_force", "constraint_mode": "cost"}

# the reference rod; across = m l²/12, along = m r²/2
ROD = """
<mujoco><compiler angle="radian"/><worldbody><body name="root" pos="0 0 1">
  <inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/><site name="grasp"/>
  <body name="rod"><joint name="swing" axis="0 -1 0" damping="0.1"/>
    <inertial pos="0 0 -0.3" mass="3.1153" diaginertia="0.093459 0.093459 0.00062306"/>
    {more}
  </body>
</body></worldbody></mujoco>
"""


@pytest.fixture
def write(tmp_path):
    def written(text):
        path = tmp_path / "object.xml"
        path.write_text(text)
        return str(path)

    return written


def example(name):
    return MjcfPayload(path=str(EXAMPLES / f"{name}.xml"))


def batch(payload, count=4, **changes):
    return DeformTransportVectorEnv(
        count, payload=payload, num_threads=1, autoreset_mode="Disabled", **FELT | changes
    )


def driven(env, steps, seed=0):
    rng = np.random.default_rng(seed)
    env.reset(seed=seed)
    actions = rng.uniform(-0.5, 0.5, (steps, *env.action_space.shape))
    return np.array([env.step(action)[0] for action in actions])


def test_a_rod_from_a_file_moves_like_the_rod_that_is_compiled(write):
    payloads = RodPayload(), MjcfPayload(path=write(ROD.format(more="")))
    rod, file = (driven(batch(payload), 100) for payload in payloads)
    force = batch(payloads[0], 1).engine.layout.slices["grasp_force_b"]
    np.testing.assert_allclose(file[..., force], rod[..., force], atol=0.5)
    np.testing.assert_allclose(
        np.delete(file, force, axis=-1), np.delete(rod, force, axis=-1), atol=6e-3
    )


@pytest.mark.parametrize("name", NAMES)
def test_one_episode_goes_as_in_a_batch(name):
    single = DeformTransportEnv(payload=example(name), **FELT)
    np.testing.assert_array_equal(driven(single, 20), driven(batch(example(name), 1), 20)[:, 0])


@pytest.mark.parametrize("name", NAMES)
def test_the_grasp_accelerates_as_it_is_asked_to(name):
    env = batch(example(name), 1)
    env.reset(options={"start": "paper"})
    asked = np.array([[0.3, 0.0, -0.1]])
    for _ in range(25):
        observation, *_ = env.step(asked)
    reached = env.engine.layout.part(observation, "grasp_velocity_b")
    np.testing.assert_allclose(reached, asked * 3.0 * 0.5, atol=0.02)


@pytest.mark.parametrize("name", NAMES)
def test_the_first_reading_is_what_holding_it_takes(name):
    env = batch(example(name), 2)
    observation, _ = env.reset(seed=1)
    simulation = env.engine.simulation
    limp = np.zeros((2, 4))
    first = env.engine.layout.part(observation, "grasp_force_b")
    weight = example(name).thing.object_file.mass_kg * 9.81
    assert np.all(np.abs(first[:, 2] - weight) < 0.02 * weight)
    simulation.hold(np.arange(2), limp)  # falling, it weighs less
    assert np.all(simulation.read().grasp_force_b[:, 2] < first[:, 2])


@pytest.mark.parametrize("name", NAMES)
def test_field_brings_it_to_the_goal(name):
    env = batch(example(name))
    controller, state = make_controller(env.unwrapped.config), None
    observation, _ = env.reset(seed=0)
    arrived = np.zeros(4, dtype=bool)
    for _ in range(600):
        action, state = controller.predict(observation, state)
        observation, _, _, _, info = env.step(action)
        arrived |= info["is_success"]
        if arrived.all():
            break
    assert arrived.all()


def test_a_state_is_gone_on_from_to_the_last_bit():
    one, other = batch(example("spherical")), batch(example("spherical"))
    driven(one, 10)
    state = get_state(one)
    action = np.full((4, 3), 0.2)
    expected = [one.step(action)[0] for _ in range(5)]
    other.reset(seed=9)
    set_state(other, state)
    np.testing.assert_array_equal([other.step(action)[0] for _ in range(5)], expected)


def test_it_is_made_from_the_mapping_that_a_specification_holds(tmp_path):
    arguments = {"payload": {"path": str(EXAMPLES / "hose.xml")}, **FELT}
    env = gymnasium.make("defmanip_gym:DeformTransport-v0", disable_env_checker=True, **arguments)
    assert env.observation_space.shape == (20 + 2 * 4,)
    assert env.unwrapped.config.payload == example("hose")
    copy = pickle.loads(pickle.dumps(example("hose")))
    assert copy == example("hose") and copy.linear.count == 4


def test_coordinates_tell_names_units_and_rest():
    slide, swing = example("bucket").coordinates
    assert (slide.name, slide.unit, swing.name, swing.unit) == ("slide", "m", "swing", "rad")


def test_images_show_it(opengl):
    env = DeformTransportEnv(payload=example("spherical"), render_mode="rgb_array", **FELT)
    env.reset(options={"start": "paper"})
    calm = env.render_camera("grasp").astype(int)
    env.reset(options={"start": (-8.5, 5.5, 0.0, np.pi / 3, -np.pi / 2, 0.5)})
    swung = env.render_camera("grasp").astype(int)
    red = [(image[..., 0] - image[..., 1] > 60).sum() for image in (calm, swung)]
    assert red[1] > red[0] + 50
    env.close()


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        (ROD.format(more="").replace("3.1153", "40"), PayloadError, "largest"),
        (ROD.format(more="").replace('name="grasp"', 'name="handle"'), ObjectFileError, "handle"),
        (ROD.format(more="").replace("0 0 -0.3", "0 0 0.3"), ObjectFileError, "stable"),
        (ROD.format(more="").replace("axis", 'type="free" axis'), ObjectFileError, ""),
    ],
    ids=["heavy", "no site", "upside down", "free joint"],
)
def test_what_cannot_be_carried_is_refused_with_a_remedy(text, error, words, write):
    with pytest.raises(error, match=words):
        batch(MjcfPayload(path=write(text)))


def test_an_object_that_touches_itself_at_rest_is_refused(write):
    ball = '<geom type="sphere" size="0.1" pos="0 0 -0.02" mass="0.1"/>'
    nested = f"""
      <geom type="sphere" size="0.1" pos="0 0 -0.4" mass="0.1"/>
      <body pos="0 0 -0.3"><joint name="a" axis="0 -1 0" damping="0.1"/>
        <geom size="0.01" mass="0.1" pos="0 0 -0.3"/>
        <body pos="0 0 -0.1"><joint name="b" axis="0 -1 0" damping="0.1"/>{ball}</body></body>"""
    with pytest.raises(ObjectFileError, match="touch"):
        MjcfPayload(path=write(ROD.format(more=nested)))


def test_what_a_payload_excludes_is_said():
    hose = example("hose")
    with pytest.raises(ParameterError, match="measured_force"):
        DeformTransportEnv(payload=hose)
    with pytest.raises(ParameterError, match="either"):
        DeformTransportEnv(payload=hose, beam=BeamParams(mass_kg=1.0), **FELT)
    with pytest.raises(ParameterError, match="MjcfPayload"):
        DeformTransportEnv(payload="hose.xml", **FELT)
    with pytest.raises(PayloadError, match="rod"):
        make_lqr(DeformTransportEnv(payload=hose, **FELT).config)


def still(payload, steps=50):
    """Return observations of an episode that begins at rest and is asked to stay so."""
    env = batch(payload, 1)
    env.reset(options={"start": "paper"})
    return np.array([env.step(np.zeros((1, 3)))[0][0] for _ in range(steps)]), env


@pytest.mark.parametrize("offset", ['ref="0.02"', 'springref="0.03" stiffness="40"'])
def test_offsets_of_joints_are_radians_in_the_plant_too(offset, write):
    payload = MjcfPayload(path=write(ROD.format(more="").replace("axis", f"{offset} axis")))
    observations, env = still(payload)
    swing = env.engine.layout.part(observations, "swing")
    (rest,) = (coordinate.rest for coordinate in payload.coordinates)
    np.testing.assert_allclose(swing, rest, atol=2e-3)
    (address,) = env.engine.simulation.model.joint("object/joint 0").qposadr
    held, plant = payload.thing.object_file.held, env.engine.simulation.model
    assert held.qpos0[0] == plant.qpos0[address]
    assert held.qpos_spring[0] == plant.qpos_spring[address]


SPRUNG = ROD.format(more="").replace(
    '<body name="rod">',
    '<body name="weight"><joint name="up" type="slide" axis="0 0 1" stiffness="3000" damping="20" '
    'springref="0.00654"/><geom size="0.05" mass="2" pos="0.3 0 0"/></body><body name="rod">',
)


def test_what_starts_against_its_springs_is_not_taken_for_another_weight(write):
    env = batch(MjcfPayload(path=write(SPRUNG)), 8)
    env.reset(seed=0)
    asked = np.tile([0.2, 0.0, 0.1], (8, 1))
    for _ in range(25):
        observation, *_ = env.step(asked)
    reached = env.engine.layout.part(observation, "grasp_velocity_b")
    np.testing.assert_allclose(reached, asked * 3.0 * 0.5, atol=0.08)


def test_what_turns_with_the_base_is_turned(write):
    wide = (
        '<body><geom type="capsule" size="0.02" fromto="0 -1.5 0.1 0 1.5 0.1" mass="8"/></body>'
        "<site"
    )
    payload = MjcfPayload(path=write(ROD.format(more="").replace("<site", wide, 1)))
    env = batch(payload, 1)
    env.reset(options={"start": "paper"})
    for _ in range(25):
        observation, *_ = env.step(np.array([[0.0, 0.2, 0.0]]))
    assert payload.yaw_inertia_kgm2 > 5.0
    left = env.engine.layout.part(observation, "grasp_velocity_b")[0, 1]
    assert abs(left - 0.3) < 0.02


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (("axis", 'springref="0.3" stiffness="300" axis'), PayloadError, "as it hangs"),
        (('name="rod"', 'name="rod" gravcomp="0.5"'), ObjectFileError, "gravcomp"),
    ],
)
def test_what_would_never_arrive_or_weighs_less_than_it_is_is_refused(change, error, words, write):
    with pytest.raises(error, match=words):
        batch(MjcfPayload(path=write(ROD.format(more="").replace(*change))))


def test_parts_that_are_rigidly_one_are_neighbours_of_what_hangs_from_them(write):
    tray = """<body name="plate"><geom size="0.05" mass="0.1"/></body>
      <body name="tray"><joint name="slide" type="slide" axis="1 0 0" stiffness="100" damping="1"/>
      <geom size="0.05" mass="0.1"/></body><body name="rod">"""
    MjcfPayload(path=write(ROD.format(more="").replace('<body name="rod">', tray)))


def test_it_stays_what_was_read_whatever_becomes_of_the_file(write, tmp_path, monkeypatch):
    path = write(ROD.format(more=""))
    monkeypatch.chdir(tmp_path)
    payload = MjcfPayload(path="object.xml")
    assert payload == MjcfPayload(path=Path(path)) and hash(payload) == hash(MjcfPayload(path=path))
    write(ROD.format(more="").replace("3.1153", "4.0"))
    assert payload != MjcfPayload(path=path)
    Path(path).unlink()
    monkeypatch.chdir("/")
    copy = pickle.loads(pickle.dumps(payload))
    assert copy == payload and copy.mass_kg == pytest.approx(3.1153) and copy.identity
    batch(copy, 1)


@pytest.mark.parametrize("arguments", [{"path": 3}, {"path": ""}, {"path": "x", "grasp_site": 1}])
def test_paths_and_names_are_texts(arguments):
    with pytest.raises(ParameterError):
        MjcfPayload(**arguments)


def test_a_specification_with_a_path_object_becomes_json():
    env = gymnasium.make(
        "defmanip_gym:DeformTransport-v1",
        payload={"path": EXAMPLES / "hose.xml"},
        disable_env_checker=True,
    )
    assert "hose.xml" in env.spec.to_json()
    with pytest.raises(ParameterError, match="beam_ranges"):
        gymnasium.make("defmanip_gym:DeformTransportRandomized-v1", payload=example("hose"))


def test_forces_need_no_loop():
    env = DeformTransportEnv(payload=example("hose"), control_mode="force")
    env.reset(seed=0)
    assert env.step(np.zeros(4))[0].shape == (28,)


def test_starts_are_within_sigma_where_the_object_is(write):
    text = ROD.format(more="").replace("axis", 'springref="0.03" stiffness="100" axis')
    env = batch(MjcfPayload(path=write(text)), 1)
    with pytest.raises(StartError, match="swing"):
        env.reset(options={"start": (-8.5, 5.5, 0.0, np.pi / 3, -np.pi / 2, 0.51)})
