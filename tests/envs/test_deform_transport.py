"""The single environment behaves as its documentation says."""

import copy
import inspect
import pickle
import re
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import defmanip_gym  # noqa: F401 - registers the id
from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.envs.starts import PAPER_START
from defmanip_gym.errors import ActionError, ParameterError, RenderingError, StartError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import PAPER_DISTURBANCE, BeamParams, DisturbanceParams, RobotParams
from defmanip_gym.task_params import StartParams, TaskParams

ENV_ID = "defmanip_gym:DeformTransport-v0"


def rollout(env, steps=60, seed=3):
    observation, info = env.reset(seed=seed)
    rows, infos = [observation], [info]
    actions = np.random.default_rng(0).uniform(-0.3, 0.3, (steps, *env.action_space.shape))
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        rows.append(np.append(observation, reward))
        infos.append(info)
        if terminated or truncated:
            break
    return rows, infos


@pytest.mark.filterwarnings("ignore:.*observation space.*infinity")
@pytest.mark.parametrize("control_mode", ["task", "force"])
def test_gymnasium_accepts_the_environment(control_mode):
    env = gymnasium.make(ENV_ID, control_mode=control_mode)
    check_env(env.unwrapped, skip_render_check=True)


def test_sb3_accepts_the_environment():
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(gymnasium.make(ENV_ID).unwrapped)


@pytest.mark.parametrize(
    "disturbance",
    [
        DisturbanceParams(),
        DisturbanceParams(force_bias_n=0.05, force_sensor_noise_n=0.1, swing_sensor_noise_rad=0.01),
    ],
)
def test_one_seed_gives_one_trajectory_bit_for_bit(disturbance):
    first, second = (rollout(gymnasium.make(ENV_ID, disturbance=disturbance))[0] for _ in range(2))
    for a, b in zip(first, second, strict=True):
        assert np.array_equal(a, b)


def test_another_seed_starts_elsewhere():
    env = gymnasium.make(ENV_ID)
    assert not np.array_equal(env.reset(seed=1)[0], env.reset(seed=2)[0])


@pytest.mark.parametrize("segments", [1, 2, 5])
def test_documented_observation_table_matches_the_space(segments):
    env = gymnasium.make(ENV_ID, beam=BeamParams(segment_count=segments))
    layout = ObservationLayout(segments)
    assert env.observation_space.shape == (layout.size,) == env.reset(seed=0)[0].shape
    assert ObservationLayout.of_size(layout.size) == layout


def test_documentation_lists_every_field_in_order():
    rows = re.findall(
        r"\| (\d+)(?:-(\d+))?\s+\| (\w+)\s+\| (.+?)\s+\| (.+?)\s+\|",
        inspect.getdoc(DeformTransportEnv).split("## Observation Space")[1].split("##")[0],
    )
    layout = ObservationLayout(1)
    documented = [
        (int(first), int(last or first) + 1, name, meaning, unit)
        for first, last, name, meaning, unit in rows
    ]
    actual = [
        (layout.slices[f.name].start, layout.slices[f.name].stop, f.name, f.meaning, f.unit)
        for f in layout.fields
    ]
    assert documented == actual


def test_documentation_lists_actions_arguments_and_reward_terms():
    text = inspect.getdoc(DeformTransportEnv)
    limits = RobotParams().force_limits
    action_tables = text.split("## Action Space")[1].split("## Observation Space")[0]
    assert len(re.findall(r"^\| \d", action_tables, re.M)) == 3 + 4
    for limit in limits:
        assert f"{limit:g} N" in action_tables
    arguments = set(
        re.findall(r"^\| (\w+)", text.split("## Arguments")[1].split("##")[0], re.M)
    ) - {"Argument"}
    assert arguments == set(DeformTransportEnv.__init__.__kwdefaults__)
    _, info = gymnasium.make(ENV_ID).reset(seed=0)
    documented = set(re.findall(r"\| (reward_\w+)", text))
    assert documented == {key for key in info if key.startswith("reward_")}
    for key in info:
        assert key in text


def test_documented_sections_follow_gymnasiums_order():
    headings = re.findall(r"^## (.+)$", inspect.getdoc(DeformTransportEnv), re.M)
    assert headings == [
        "Description",
        "Action Space",
        "Observation Space",
        "Rewards",
        "Starting State",
        "Episode End",
        "Arguments",
        "Version History",
    ]


def test_info_has_the_same_keys_and_types_every_step():
    _, infos = rollout(gymnasium.make(ENV_ID))
    kinds = {tuple((key, type(value)) for key, value in info.items()) for info in infos}
    assert len(kinds) == 1


def test_reward_is_the_sum_of_its_terms():
    rows, infos = rollout(gymnasium.make(ENV_ID, constraint_mode="penalty"))
    for row, info in zip(rows[1:], infos[1:], strict=True):
        terms = [value for key, value in info.items() if key.startswith("reward_")]
        assert row[-1] == pytest.approx(sum(terms), abs=1e-12)


def test_paper_start_puts_the_grasp_where_the_paper_does():
    env = gymnasium.make(ENV_ID)
    observation, _ = env.reset(options={"start": "paper"})
    explicit, _ = env.reset(options={"start": PAPER_START})
    assert np.array_equal(observation, explicit)
    x, y, _, q1, q2, _ = PAPER_START
    reach = 0.6 * np.cos(q1) + 0.7 * np.cos(q1 + q2)
    height = 0.4 + 0.6 * np.sin(q1) + 0.7 * np.sin(q1 + q2)
    assert observation[:3] == pytest.approx([0.7 - (x + reach), -y, 1.0 - height])


def test_beam_at_rest_weighs_on_the_force_sensor():
    observation, _ = gymnasium.make(ENV_ID).reset(options={"start": "paper"})
    assert observation[16:19] == pytest.approx([0, 0, BeamParams().mass_kg * 9.81], abs=1e-9)


def test_exceeding_sigma_ends_the_episode_only_in_terminate_mode():
    for mode, ends in (("terminate", True), ("penalty", False), ("cost", False)):
        env = gymnasium.make(ENV_ID, constraint_mode=mode, sigma_rad=0.1)
        env.reset(options={"start": "paper"})
        for _ in range(30):
            *_, terminated, _, info = env.step(np.array([1.0, 0.0, 0.0]))
            if terminated:
                break
        assert info["cost"] == 1.0 and info["constraint_margin"] < 0
        assert terminated is ends
        assert (info["reward_deformation"] < 0) is (mode == "penalty")
        assert (info["reward_failure"] < 0) is ends


def test_speed_limit_holds_and_leaves_braking_alone():
    task = TaskParams()
    env = gymnasium.make(ENV_ID, constraint_mode="cost")
    env.reset(options={"start": "paper"})
    for _ in range(60):
        observation, *_ = env.step(np.array([1.0, 0.0, 0.0]))
    speed = np.linalg.norm(observation[5:8])
    assert speed == pytest.approx(task.max_speed_m_s, rel=0.03)
    braked, *_ = env.step(np.array([-1.0, 0.0, 0.0]))
    expected = speed - task.max_acceleration_m_s2 * task.control_period_s
    assert np.linalg.norm(braked[5:8]) == pytest.approx(expected, abs=2e-3)


def test_force_mode_reports_excess_speed():
    env = gymnasium.make(ENV_ID, control_mode="force", constraint_mode="cost")
    env.reset(options={"start": "paper"})
    costs = [env.step(np.array([1.0, 0.0, 0.25, -0.1]))[4]["cost_speed"] for _ in range(25)]
    assert costs[0] == 0.0
    assert max(costs) > 0.0


def test_bias_force_pushes_a_motionless_robot():
    env = gymnasium.make(ENV_ID, disturbance=PAPER_DISTURBANCE)
    env.reset(options={"start": "paper"})
    for _ in range(50):
        observation, *_ = env.step(np.zeros(3))
    # 0.05 N on a robot of some tens of kilograms, for one second
    assert 1e-4 < observation[5] < 2e-2


@pytest.mark.parametrize(
    "action", [np.full(3, np.nan), np.zeros(4), np.zeros((1, 3)), [0.0, np.inf, 0.0], "left"]
)
def test_bad_actions_are_refused_by_name(action):
    env = gymnasium.make(ENV_ID, disable_env_checker=True)
    env.reset(seed=0)
    with pytest.raises(ActionError, match="allowed"):
        env.unwrapped.step(action)


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("control_mode", "torque"),
        ("constraint_mode", "ignore"),
        ("render_mode", "ascii"),
        ("sigma_rad", 0.0),
        ("sigma_rad", -0.1),
        ("sigma_rad", 1.2),
        ("sigma_rad", float("nan")),
        ("nominal_beam", BeamParams(segment_count=2)),
        ("beam", "steel"),
        ("task", {"gaol": (0.0,) * 6}),
        ("disturbance", 0.05),
        ("nominal_robot", 1),
    ],
)
def test_bad_arguments_are_refused_by_name(argument, value):
    with pytest.raises(ParameterError, match=argument):
        DeformTransportEnv(**{argument: value})


@pytest.mark.parametrize(
    "options",
    [
        {"start": "papr"},
        {"start": (0, 0, 0)},
        {"start": (0, 0, 0, 1.0, 0.0, 0)},  # straight elbow
        {"start": (99, 0, 0, 1.0, -1.5, 0)},  # outside the arena
        {"start": (0, 0, 0, 1.0, -1.5, 0.9)},  # beyond sigma
        {"start": (0, 0, float("nan"), 1.0, -1.5, 0)},
        {"begin": "paper"},
    ],
)
def test_bad_starts_are_refused_and_leave_the_episode_as_it_was(options):
    env = gymnasium.make(ENV_ID)
    env.reset(seed=0)
    before = env.unwrapped.engine.plant_state.base_pose.copy()
    with pytest.raises(StartError, match="allowed"):
        env.reset(options=options)
    assert np.array_equal(before, env.unwrapped.engine.plant_state.base_pose)


def test_copies_and_pickles_are_equal_environments():
    env = DeformTransportEnv(beam=BeamParams(damping=0.3))
    for other in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        assert other.config == env.config
        assert np.array_equal(other.reset(seed=1)[0], env.reset(seed=1)[0])


def test_starts_that_sampling_could_not_take_are_refused_at_construction():
    with pytest.raises(ParameterError, match="sigma_rad"):
        DeformTransportEnv(sigma_rad=0.03)
    with pytest.raises(StartError, match="workspace"):
        DeformTransportEnv(task=TaskParams(start=StartParams(center=(100, 0, 0, 1, -1.5, 0))))


def test_a_window_without_a_display_is_refused(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if sys.platform == "linux":
        with pytest.raises(RenderingError, match="display"):
            DeformTransportEnv(render_mode="human").reset(seed=0)


def test_success_needs_all_four_tolerances():
    env = gymnasium.make(ENV_ID)
    goal = TaskParams().goal
    _, info = env.reset(options={"start": goal})
    assert info["is_success"] is True
    for index, offset in ((0, 0.06), (2, 0.25), (5, 0.06)):
        start = np.array(goal)
        start[index] += offset
        _, info = env.reset(options={"start": tuple(start)})
        assert info["is_success"] is False
