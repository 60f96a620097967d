"""A state that was kept is a state to go on from: the same actions, the same episodes."""

import copy
import pickle

import gymnasium
import mujoco
import numpy as np
import pytest
from gymnasium.wrappers import FrameStackObservation, NormalizeReward, TransformObservation
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

from defmanip_gym import get_state, set_state
from defmanip_gym.baselines.residual_action import ResidualAction, ResidualVectorAction
from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import ParameterError, StateError
from defmanip_gym.params import BeamParams, BeamRanges, DisturbanceParams
from defmanip_gym.plant import names
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.theory.filters.conditions import FilterConditions
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.training.state_file import read_state, write_state
from defmanip_gym.wrappers.action_delay import ActionDelay
from defmanip_gym.wrappers.nu_max_scaling import NuMaxActionScaling, NuMaxVectorActionScaling
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper, SafetyFilterWrapper

CERTIFICATE = certify(BeamParams(), conditions=TRANSPORT_CONDITIONS)
NOISY = DisturbanceParams(
    force_amplitude_n=1.0, force_frequency_rad_s=3.0, force_sensor_noise_n=0.1
)
ARGUMENTS = {
    "task": {},
    "force": {"control_mode": "force"},
    "three segments": {"beam": BeamParams(segment_count=3, damping=0.1)},
    "drawn beams": {"beam_ranges": BeamRanges(damping=(0.05, 1.0), mass_kg=(0.5, 2.0))},
    "noise": {"disturbance": NOISY},
    "felt force": {"inner_loop": "measured_force", "disturbance": NOISY},
    "soon violated": {"sigma_rad": 0.06},
}
MODES = ("NextStep", "SameStep", "Disabled")


def episodes(env, steps, seed=0):
    """Step with actions of a seed; return all that was told, exactly."""
    rng = np.random.default_rng(seed)
    told = []
    for _ in range(steps):
        result = env.step(rng.uniform(-1, 1, env.action_space.shape))
        told.append(repr([plainly(part) for part in result]))
        ended = np.any(result[2]) or np.any(result[3])
        if ended and isinstance(env.unwrapped, gymnasium.Env):
            told.append(repr(plainly(env.reset()[0])))
    return told


def plainly(value):
    if isinstance(value, dict):
        clocks = {"t", "_t"}
        return {key: plainly(each) for key, each in value.items() if key not in clocks}
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def goes_on_alike(env, other=None, steps=40):
    state = get_state(env)
    expected = episodes(env, steps)
    if other is not None:
        set_state(other, state)
        return episodes(other, steps) == expected
    set_state(env, state)
    return episodes(env, steps) == expected


@pytest.mark.parametrize("arguments", ARGUMENTS.values(), ids=ARGUMENTS)
def test_a_single_environment_goes_on_from_its_state(arguments):
    env = gymnasium.make(ENV_ID, max_episode_steps=25, **arguments)
    env.reset(seed=1)
    episodes(env, 30, seed=1)
    assert goes_on_alike(env)
    assert goes_on_alike(env, gymnasium.make(ENV_ID, max_episode_steps=25, **arguments))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("arguments", ARGUMENTS.values(), ids=ARGUMENTS)
def test_a_batch_goes_on_from_its_state(arguments, mode, make_batch):
    arguments = {
        "num_envs": 5,
        "max_episode_steps": 25,
        "constraint_mode": "terminate",
        "autoreset_mode": mode,
        **arguments,
    }
    env = make_batch(**arguments)
    env.reset(seed=1)
    episodes(env, 35, seed=1)
    assert goes_on_alike(env)
    assert goes_on_alike(env, make_batch(**arguments))


def test_a_state_is_not_changed_by_what_follows(make_batch):
    env = make_batch(3, disturbance=NOISY, autoreset_mode="SameStep", max_episode_steps=10)
    env.reset(seed=0)
    state = env.unwrapped.get_state()
    before = pickle.dumps(state)
    for _ in range(2):
        env.unwrapped.set_state(state)
        episodes(env, 25)
        assert pickle.dumps(state) == before


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_and_pickles_go_on_in_the_middle_of_an_episode(copied, make_batch):
    single = gymnasium.make(ENV_ID, disturbance=NOISY, max_episode_steps=30)
    for env in (
        single,
        NuMaxActionScaling(gymnasium.make(ENV_ID), CERTIFICATE),
        make_batch(4, autoreset_mode="NextStep", max_episode_steps=30),
        NuMaxVectorActionScaling(make_batch(4), CERTIFICATE),
        SafetyFilterWrapper(gymnasium.make(ENV_ID), StorageFilter()),
        SafetyFilterVectorWrapper(make_batch(4), StorageFilter()),
    ):
        env.reset(seed=3)
        episodes(env, 20, seed=3)
        twin = copied(env)
        assert str(twin) == str(env)
        assert episodes(twin, 20) == episodes(env, 20)


@pytest.mark.parametrize(
    "wrap",
    [
        lambda env: NuMaxActionScaling(env, CERTIFICATE),
        lambda env: ResidualAction(env, decision_periods=3),
        lambda env: FrameStackObservation(NormalizeReward(env), 3),
    ],
)
def test_memories_of_wrappers_are_part_of_it(wrap):
    env, other = (wrap(gymnasium.make(ENV_ID, max_episode_steps=30)) for _ in range(2))
    env.reset(seed=1)
    episodes(env, 25, seed=1)
    assert goes_on_alike(env)
    assert goes_on_alike(env, other)


@pytest.mark.parametrize(
    "wrap",
    [
        lambda env: NuMaxVectorActionScaling(env, CERTIFICATE),
        lambda env: NuMaxVectorActionScaling(ActionDelay(env, 3), CERTIFICATE),
        lambda env: ResidualVectorAction(env, decision_periods=3),
        lambda env: RecordEpisodeStatistics(env),
    ],
)
def test_memories_of_a_batchs_wrappers_are_part_of_it(wrap, make_batch):
    arguments = {"num_envs": 4, "max_episode_steps": 30, "autoreset_mode": "SameStep"}
    env, other = wrap(make_batch(**arguments)), wrap(make_batch(**arguments))
    env.reset(seed=1)
    episodes(env, 25, seed=1)
    assert goes_on_alike(env)
    assert goes_on_alike(env, other)


def test_running_statistics_of_gymnasiums_wrappers_are_part_of_it(make_batch):
    env = NormalizeObservation(make_batch(4, autoreset_mode="NextStep"))
    env.reset(seed=1)
    episodes(env, 10)
    assert goes_on_alike(env)


def test_a_planner_tries_many_actions_from_the_state_of_one_episode(make_batch):
    env, planner = DeformTransportEnv(disturbance=NOISY), make_batch(8)
    env.reset(seed=0)
    env.step(np.ones(3))
    planner.unwrapped.set_state(env.get_state())
    actions = np.random.default_rng(0).uniform(-1, 1, (8, 3))
    futures = planner.step(actions)[0]
    assert len(np.unique(futures[:, 5])) == 8
    alike = DeformTransportEnv()  # it knows nothing of noise and force
    alike.set_state(env.get_state())
    assert np.array_equal(alike.step(actions[2])[0], futures[2])
    planner.unwrapped.set_state(env.get_state())
    assert np.array_equal(planner.step(actions)[0], futures)


class Locked(gymnasium.Wrapper):
    """Holds what nobody can copy."""

    def __init__(self, env):
        super().__init__(env)
        self.count, self.lines = 0, (line for line in "ab")


class Named(Locked):
    """Says what it remembers of that."""

    remembers = ("count",)


def test_a_wrapper_that_cannot_be_copied_is_told_how_to_say_what_it_remembers():
    with pytest.raises(StateError, match="remembers"):
        get_state(Locked(DeformTransportEnv()))
    env = Named(DeformTransportEnv())
    env.count = 4
    state = get_state(env)
    env.count = 5
    set_state(env, state)
    assert env.count == 4


@pytest.mark.parametrize(
    "wrapped",
    [
        ResidualVectorAction,
        lambda env: SafetyFilterVectorWrapper(env, StorageFilter()),
        lambda env: SafetyFilterVectorWrapper(
            env, StorageFilter(conditions=FilterConditions(swing_noise_rad=0.01, delay_periods=1))
        ),
    ],
    ids=["residual", "storage", "storage with noise and delay"],
)
def test_states_of_the_packages_wrappers_go_to_disk_without_pickle(wrapped, make_batch, tmp_path):
    def made():
        arguments = {"num_envs": 3, "autoreset_mode": "SameStep", "disturbance": NOISY}
        return wrapped(make_batch(**arguments, max_episode_steps=30))

    env, other = made(), made()
    env.reset(seed=1)
    episodes(env, 20)
    write_state(tmp_path, get_state(env))
    set_state(other, read_state(tmp_path))
    assert episodes(other, 20) == episodes(env, 20)  # on into the next episodes


def test_a_simulation_that_failed_goes_on_having_failed(make_batch):
    env = make_batch(2)
    env.reset(seed=0)
    env.unwrapped.engine.simulation._velocity[1] = 1e6
    assert env.step(np.zeros((2, 3)))[4]["simulation_failed"].tolist() == [False, True]
    other = make_batch(2)
    set_state(other, get_state(env))
    assert episodes(other, 3) == episodes(env, 3)


def test_mujocos_fields_are_those_of_the_episode(make_batch):
    env = DeformTransportEnv()
    _, info = env.reset(seed=0, options={"start": "paper"})
    assert env.dt == pytest.approx(0.02) and env.frame_skip == 4
    assert isinstance(env.model, mujoco.MjModel)
    state, data = env.engine.plant_state, env.data
    assert np.allclose(data.qpos[:3], state.base_pose[0])
    assert data.time == 0
    env.step(np.ones(3))
    assert env.data.time == pytest.approx(0.02)
    before = env.data.qpos.copy()
    env.data.qpos[:] = 9.0  # a copy
    assert np.array_equal(env.data.qpos, before)
    drawn = make_batch(3, beam_ranges=BeamRanges(mass_kg=(0.5, 2.0))).unwrapped
    _, info = drawn.reset(seed=0)
    for i, mass_kg in enumerate(info["beam_mass_kg"]):
        assert drawn.get_model(i).body(names.segment(0)).mass.item() == pytest.approx(mass_kg)
        assert np.array_equal(drawn.get_data(i).qpos[:3], drawn.engine.plant_state.base_pose[i])
    with pytest.raises(ParameterError, match="index"):
        drawn.get_data(3)


def test_a_beam_that_was_set_stays_in_copies_and_goes_with_the_episode():
    drawn = gymnasium.make("defmanip_gym:DeformTransportRandomized-v0").unwrapped
    drawn.reset(seed=0)
    env = DeformTransportEnv()
    _, info = env.reset(seed=1)
    own, given = env.get_state(), info["beam_mass_kg"]
    env.set_state(drawn.get_state())
    assert env.step(np.ones(3))[4]["beam_mass_kg"] != given
    twin = copy.deepcopy(env)
    assert episodes(twin, 20) == episodes(env, 20)
    assert env.reset(seed=1)[1]["beam_mass_kg"] == given
    expected = episodes(env, 20)
    env.set_state(drawn.get_state())
    env.set_state(own)
    assert episodes(env, 20) == expected


def test_how_a_wrapper_was_made_is_not_part_of_its_memory():
    def made(limit):
        env = gymnasium.make(ENV_ID, max_episode_steps=limit)
        return TransformObservation(env, lambda _: env.unwrapped.data.qpos, None)

    short, long = made(10), made(1000)
    short.reset(seed=0)
    long.reset(seed=1)
    episodes(short, 6)
    set_state(long, pickle.loads(pickle.dumps(get_state(short))))
    short.step(np.zeros(3))
    moved, *_ = long.step(np.ones(3))
    assert np.array_equal(moved, long.unwrapped.data.qpos)  # not the other's
    ends = [bool(long.step(np.zeros(3))[3]) for _ in range(20)]
    assert not any(ends)
