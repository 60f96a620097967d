"""Statistics that SB3's models were trained with are found, or asked for, and never left out."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from sb3_contrib import TQC
from sb3_models import saved, trained
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.callbacks import CheckpointCallback

from defmanip_gym.baselines.learned.agents import load_controller
from defmanip_gym.baselines.learned.sb3_zip import load_sb3_zip
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import AgentFileError, ParameterError
from defmanip_gym.evaluation.comparison import ComparisonConfig
from defmanip_gym.evaluation.learned_contestants import agent_contestants
from defmanip_gym.evaluation.protection import Certificates

OBSERVATIONS = np.random.default_rng(0).normal(2.0, 3.0, size=(5, 22))
ALGORITHMS = pytest.mark.parametrize("algorithm", [PPO, SAC, TQC, TD3])


def normalized(folder, name="model.zip", algorithm=PPO):
    """Save a model that was trained inside VecNormalize, and return both."""
    model = trained(algorithm, {})
    model.save(folder / name)
    return model, model.get_vec_normalize_env()


def acts_as(path, model, statistics, **options):
    seen = OBSERVATIONS if statistics is None else statistics.normalize_obs(OBSERVATIONS)
    expected = model.predict(seen, deterministic=True)[0]
    actions = load_sb3_zip(path, **options).predict(OBSERVATIONS, deterministic=True)[0]
    return np.allclose(actions, expected, atol=1e-6)


@ALGORITHMS
def test_a_model_that_was_trained_normalized_never_runs_without(algorithm, tmp_path):
    normalized(tmp_path, algorithm=algorithm)
    path = tmp_path / "model.zip"
    for options in ({}, {"normalization": "none"}):
        with pytest.raises(AgentFileError, match=r"model_vecnormalize\.pkl.*--normalization"):
            load_sb3_zip(path, **options)


@ALGORITHMS
def test_a_model_that_was_not_runs_without_whatever_lies_beside_it(algorithm, tmp_path):
    _, others = normalized(tmp_path, "other.zip")
    others.save(tmp_path / "vecnormalize.pkl")
    for number, normalization in enumerate((None, {"norm_obs": False})):
        path = tmp_path / f"plain-{number}.zip"
        model = trained(algorithm, normalization)
        model.save(path)
        assert acts_as(path, model, None)
        with pytest.raises(AgentFileError, match="as they are"):
            load_sb3_zip(path, str(tmp_path / "vecnormalize.pkl"))


@pytest.mark.parametrize(
    "name",
    [
        "vec_normalize.pkl",
        "vecnormalize.pkl",
        "VecNormalize.pickle",
        "model_vecnormalize.pkl",
        "vec_normalize_model.pkl",
        "model.pkl",
        "model/vec_normalize.pkl",
        "model/stats.pkl",
        f"{ENV_ID}/vecnormalize.pkl",
    ],
)
def test_statistics_are_found_under_usual_names(name, tmp_path):
    model, normalization = normalized(tmp_path)
    (tmp_path / name).parent.mkdir(exist_ok=True)
    normalization.save(tmp_path / name)
    assert acts_as(tmp_path / "model.zip", model, normalization)


@ALGORITHMS
def test_checkpoints_of_sb3_get_the_statistics_of_their_own_step(algorithm, tmp_path):
    callback = CheckpointCallback(8, tmp_path, save_vecnormalize=True)
    model = trained(algorithm, {}, callback)
    model.get_vec_normalize_env().save(tmp_path / "vec_normalize.pkl")
    paths = [tmp_path / f"rl_model_{steps}_steps.zip" for steps in (8, 16)]
    first, last = (load_sb3_zip(path) for path in paths)
    for steps, controller in ((8, first), (16, last)):
        named = str(tmp_path / f"rl_model_vecnormalize_{steps}_steps.pkl")
        assert load_sb3_zip(tmp_path / f"rl_model_{steps}_steps.zip", named).digest == (
            controller.digest
        )
    (tmp_path / "rl_model_vecnormalize_8_steps.pkl").unlink()
    assert load_sb3_zip(paths[0]).digest != first.digest  # the training's last ones
    (tmp_path / "vec_normalize.pkl").unlink()
    with pytest.raises(AgentFileError, match=r"model_8_steps_vecnormalize\.pkl"):
        load_sb3_zip(paths[0])  # those of step 16 are the other zip file's
    paths[1].unlink()
    with pytest.raises(AgentFileError, match=r"vecnormalize_16_steps\.pkl.*--normalization"):
        load_sb3_zip(paths[0])


def test_what_can_be_meant_is_named_and_a_choice_is_taken(tmp_path):
    path = tmp_path / "model.zip"
    model, normalization = normalized(tmp_path)
    normalization.save(tmp_path / "vec_normalize.pkl")
    normalization.save(tmp_path / "vecnormalize.pkl")
    assert acts_as(path, model, normalization)  # the same twice
    normalization.obs_rms.mean += 1.0
    chosen = tmp_path / "vecnormalize.pkl"
    normalization.save(chosen)
    with pytest.raises(AgentFileError, match=r"vec_normalize\.pkl, .*vecnormalize\.pkl.*--norm"):
        load_sb3_zip(path)
    assert acts_as(path, model, normalization, normalization=str(chosen))
    load_controller(path, allow_pickle=True, normalization=str(chosen))
    with pytest.raises(AgentFileError, match="Check the path"):
        load_sb3_zip(path, "missing.pkl")


def test_statistics_that_normalize_rewards_only_do_not_serve(tmp_path):
    _, normalization = normalized(tmp_path)
    normalization.norm_obs = False
    normalization.save(tmp_path / "vecnormalize.pkl")
    with pytest.raises(AgentFileError, match="with the model"):
        load_sb3_zip(tmp_path / "model.zip")


def test_a_model_that_does_not_tell_is_asked_for_where_others_statistics_lie(tmp_path):
    path = tmp_path / "model.zip"
    model = saved(path)  # never trained
    assert acts_as(path, model, None)
    _, normalization = normalized(tmp_path, "another.zip")
    normalization.save(tmp_path / "another_vecnormalize.pkl")
    assert acts_as(path, model, None)
    normalization.save(tmp_path / "best_vecnormalize.pkl")
    with pytest.raises(AgentFileError, match=r"best_vecnormalize\.pkl.*'none'"):
        load_sb3_zip(path)
    assert acts_as(path, model, None, normalization="none")


def test_other_pickles_are_neither_taken_nor_run(tmp_path):
    _, normalization = normalized(tmp_path)
    normalization.save(tmp_path / "vecnormalize.pkl")
    (tmp_path / "replay_buffer.pkl").write_bytes(b"no pickle")
    (tmp_path / "model.pkl").write_bytes(b"no pickle")
    load_sb3_zip(tmp_path / "model.zip")


def test_the_comparison_takes_the_choice_for_its_only_zip_file(tmp_path):
    path, statistics = tmp_path / "model.zip", tmp_path / "any.pkl"
    _, normalization = normalized(tmp_path)
    normalization.save(statistics)
    plain, _ = agent_contestants(
        path, Certificates(), allow_pickle=True, normalization=str(statistics)
    )
    plain.members[0].controller.build([1])
    settings = {"allow_pickle": True, "normalization": str(statistics)}
    assert "--normalization" in ComparisonConfig(agents=(path,), **settings).command
    for wrong in ({"agents": (path, path)}, {"agents": (path,), "allow_pickle": False}):
        with pytest.raises(ParameterError, match="normalization"):
            ComparisonConfig(**(settings | wrong))
