"""Every vector wrapper of Gymnasium runs on the batch as ``make_vec`` makes it by default."""

import gymnasium
import gymnasium.wrappers.vector as wrappers
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.wrappers import transform_action, transform_observation, transform_reward

ENV_ID = "defmanip_gym:DeformTransport-v0"
COUNT = 2
IMAGE = spaces.Box(0, 255, (8, 8, 3), np.uint8)


def as_images(env):
    """Observations as images, which some wrappers are for."""
    return wrappers.VectorizeTransformObservation(
        env,
        transform_observation.TransformObservation,
        func=lambda _: np.zeros(IMAGE.shape, np.uint8),
        observation_space=IMAGE,
    )


def as_parts(env):
    """Observations as a dict, for the wrapper that picks some of its keys."""
    box = env.single_observation_space
    return wrappers.VectorizeTransformObservation(
        env,
        transform_observation.TransformObservation,
        func=lambda observation: {"all": observation, "first": observation},
        observation_space=spaces.Dict(all=box, first=box),
    )


def as_bounded(env):
    """Observations in bounds, which rescaling needs."""
    size = env.single_observation_space.shape
    return wrappers.VectorizeTransformObservation(
        env,
        transform_observation.TransformObservation,
        func=np.tanh,
        observation_space=spaces.Box(-1.0, 1.0, size, np.float64),
    )


PREPARED = {
    "FilterObservation": as_parts,
    "GrayscaleObservation": as_images,
    "ResizeObservation": as_images,
    "RescaleObservation": as_bounded,
}
ARGUMENTS = {
    "VectorizeTransformObservation": {
        "wrapper": transform_observation.FlattenObservation,
    },
    "VectorizeTransformAction": {"wrapper": transform_action.ClipAction},
    "VectorizeTransformReward": {
        "wrapper": transform_reward.ClipReward,
        "min_reward": -1.0,
        "max_reward": 1.0,
    },
    "TransformObservation": {"func": lambda observation: 2 * observation},
    "FilterObservation": {"filter_keys": ["first"]},
    "ResizeObservation": {"shape": (4, 4)},
    "ReshapeObservation": {"shape": (2, 11)},
    "RescaleObservation": {"min_obs": 0.0, "max_obs": 1.0},
    "DtypeObservation": {"dtype": np.float32},
    "TransformAction": {"func": lambda actions: 0.5 * actions},
    "RescaleAction": {"min_action": -2.0, "max_action": 2.0},
    "TransformReward": {"func": lambda reward: 2 * reward},
    "ClipReward": {"min_reward": -1.0, "max_reward": 1.0},
}
NEEDS = {
    "ResizeObservation": ["cv2"],
    "RecordVideo": ["moviepy"],
    "HumanRendering": ["pygame"],
    "ArrayConversion": ["array_api_compat"],
    "JaxToNumpy": ["jax"],
    "JaxToTorch": ["jax", "torch"],
    "NumpyToTorch": ["array_api_compat", "torch"],
}


def arguments_of(name, tmp_path):
    if name == "RecordVideo":
        return {"video_folder": str(tmp_path), "step_trigger": lambda step: step == 0}
    if name == "ArrayConversion":
        return {"env_xp": np, "target_xp": np}
    return ARGUMENTS.get(name, {})


@pytest.mark.parametrize("name", wrappers.__all__)
def test_every_vector_wrapper_runs_across_episode_ends(name, tmp_path, monkeypatch):
    for module in NEEDS.get(name, []):
        pytest.importorskip(module)
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    draws = name in ("RecordVideo", "HumanRendering")
    env = gymnasium.make_vec(
        ENV_ID, num_envs=COUNT, max_episode_steps=3, render_mode="rgb_array" if draws else None
    )
    env = PREPARED.get(name, lambda env: env)(env)
    env = getattr(wrappers, name)(env, **arguments_of(name, tmp_path))
    env.reset(seed=0)
    ends = 0
    action = np.zeros((COUNT, 3))
    if "ToTorch" in name:
        action = pytest.importorskip("torch").from_numpy(action)
    for _ in range(10):
        _, _, terminated, truncated, _ = env.step(action)
        ends += int((terminated | truncated).sum())
    env.close()
    assert ends == 2 * COUNT


def one_after_another(mode, **arguments):
    """Gymnasium's own batch, of single environments."""
    return gymnasium.vector.SyncVectorEnv(
        [lambda: gymnasium.make(ENV_ID, **arguments)] * 3, autoreset_mode=mode
    )


def same(ours, theirs, mask=True):
    """Whether the batch says all that the other one does, where that says anything."""
    for key, value in theirs.items():
        if key.startswith("_"):
            continue
        told = np.asarray(theirs[f"_{key}"]) & mask
        if isinstance(value, dict):
            same(ours[key], value, told)
            continue
        for i in np.flatnonzero(told):
            assert np.array_equal(ours[key][i], value[i]), key
    assert {key for key in theirs if not key.startswith("_")} == {
        key for key in ours if not key.startswith("_")
    }


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_the_batch_is_what_gymnasiums_own_would_be(mode):
    arguments = {"max_episode_steps": 12}
    batch = gymnasium.make_vec(ENV_ID, num_envs=3, autoreset_mode=mode, **arguments)
    envs = [
        wrappers.RecordEpisodeStatistics(each)
        for each in (batch, one_after_another(mode, **arguments))
    ]
    (ours, info), (theirs, other) = (env.reset(seed=5) for env in envs)
    assert np.array_equal(ours, theirs)
    same(info, other)
    actions = np.random.default_rng(0).uniform(0.2, 1.0, (40, 3, 3))
    for action in actions:
        first, second = (env.step(action) for env in envs)
        for one, another in zip(first[:4], second[:4], strict=True):
            assert np.array_equal(one, another)
        for info in (first[4], second[4]):
            info.get("episode", {}).pop("t", None)
        episode, recorded = (info.pop("episode", None) for info in (first[4], second[4]))
        assert (episode is None) == (recorded is None)
        if episode is not None:
            assert all(np.array_equal(episode[key], recorded[key]) for key in ("r", "l"))
        same(first[4], second[4])
    assert len(envs[0].length_queue) == len(envs[1].length_queue) >= 9
    for env in envs:
        env.close()
