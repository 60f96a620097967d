"""SB3's zip files: refused unless allowed, and then run as the model acts."""

import sys
import zipfile

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from sb3_contrib import TQC
from sb3_models import Spaces, poisoned, saved
from stable_baselines3 import A2C, PPO, SAC, TD3
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from defmanip_gym.baselines.learned.agents import load_agent, load_controller
from defmanip_gym.baselines.learned.sb3_zip import load_sb3_zip
from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import AgentFileError

OBSERVATIONS = np.random.default_rng(0).normal(size=(5, 22))


def test_a_strangers_zip_runs_nothing_unless_allowed(tmp_path):
    path, trace = tmp_path / "model.zip", tmp_path / "it-ran"
    poisoned(path, trace)
    for load in (load_agent, load_controller):
        with pytest.raises(AgentFileError, match="--allow-pickle"):
            load(path)
    assert not trace.exists()
    load_controller(path, allow_pickle=True)
    assert trace.exists()  # the danger is real


@pytest.mark.parametrize("algorithm", [PPO, SAC, TQC, TD3])
def test_an_allowed_model_acts_as_it_does_in_sb3(algorithm, tmp_path):
    model = saved(tmp_path / "model.zip", algorithm)
    controller = load_controller(tmp_path / "model.zip", allow_pickle=True)
    expected = model.predict(OBSERVATIONS, deterministic=True)[0]
    assert controller.predict(OBSERVATIONS, deterministic=True)[0] == pytest.approx(expected)
    single = controller.predict(OBSERVATIONS[0], deterministic=True)[0]
    assert single == pytest.approx(expected[0], abs=1e-6)
    assert controller.algorithm == algorithm.__name__.lower()


@pytest.mark.parametrize("folder", ["", "model", ENV_ID])
def test_normalization_beside_the_zip_is_applied(folder, tmp_path):
    model = saved(tmp_path / "model.zip")
    plain = load_sb3_zip(tmp_path / "model.zip")
    normalize = VecNormalize(DummyVecEnv([Spaces]))
    normalize.obs_rms.update(3.0 + 2.0 * OBSERVATIONS)
    (tmp_path / folder).mkdir(exist_ok=True)
    normalize.save(tmp_path / folder / "vecnormalize.pkl")
    controller = load_sb3_zip(tmp_path / "model.zip")
    expected = model.predict(normalize.normalize_obs(OBSERVATIONS), deterministic=True)[0]
    assert controller.predict(OBSERVATIONS, deterministic=True)[0] == pytest.approx(expected)
    assert controller.digest != plain.digest


def test_models_and_normalizations_of_other_spaces_are_refused(tmp_path):
    path = tmp_path / "model.zip"
    for env in (Spaces((4, 4)), Spaces(limit=2.0)):
        saved(path, env=env)
        with pytest.raises(AgentFileError, match="another environment"):
            load_sb3_zip(path)
    saved(path, env=Spaces((24,)))
    with pytest.raises(AgentFileError, match="segments"):
        load_sb3_zip(path).predict(OBSERVATIONS)
    VecNormalize(DummyVecEnv([Spaces])).save(tmp_path / "vecnormalize.pkl")
    with pytest.raises(AgentFileError, match="same training"):
        load_sb3_zip(path)


def test_foreign_and_damaged_zips_are_refused(tmp_path):
    path = tmp_path / "model.zip"
    saved(path, A2C)
    with pytest.raises(AgentFileError, match="PPO"):
        load_sb3_zip(path)
    saved(path)
    (tmp_path / "vecnormalize.pkl").write_bytes(b"no pickle")
    with pytest.raises(AgentFileError, match="damaged"):
        load_sb3_zip(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "hello")
    with pytest.raises(AgentFileError, match="foreign"):
        load_sb3_zip(path)
    path.write_bytes(b"PK")
    with pytest.raises(AgentFileError):
        load_controller(path, allow_pickle=True)


def test_without_sb3_the_error_says_what_to_install(tmp_path, monkeypatch):
    saved(tmp_path / "model.zip")
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(AgentFileError, match="pip install"):
        load_sb3_zip(tmp_path / "model.zip")
