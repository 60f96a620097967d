"""Exported agents act as the agents do."""

import json
import subprocess
import sys

import numpy as np
import pytest
from small_agents import small_agent

from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.baselines.learned.sb3_zip import load_sb3_zip
from defmanip_gym.errors import AgentFileError, ParameterError
from defmanip_gym.evaluation.conditions import NOMINAL
from defmanip_gym.evaluation.rollout import courses
from defmanip_gym.exports.command import run_export
from defmanip_gym.exports.config import ExportConfig
from defmanip_gym.exports.onnx_graph import INPUT, OUTPUT, onnx_bytes

AGENTS = ["sac", "ppo/seed-3", "tqc", "lagrangian"]


def met(actor):
    """Return observations that an agent meets, and far ones that its clipping is for."""
    (course,) = courses(actor, [0], config=NOMINAL.environment, steps=500)
    return np.concatenate((course.observation, 50.0 * course.observation[:20]))


@pytest.mark.parametrize("name", AGENTS)
def test_the_graph_gives_the_agents_actions(name):
    pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    actor = load_agent(name)
    session = runtime.InferenceSession(onnx_bytes(actor))
    observations = met(actor)
    (actions,) = session.run([OUTPUT], {INPUT: observations.astype(np.float32)})
    assert actions.dtype == np.float32 and actions.shape == (len(observations), 3)
    assert np.abs(actions - actor.predict(observations)[0]).max() < 1e-4
    told = session.get_modelmeta().custom_metadata_map
    assert actor.digest in told["agent"] and told["env_id"] == "DeformTransport-v0"
    assert json.loads(told["env_kwargs"]) == (actor.card.hyperparameters.get("env_kwargs") or {})


@pytest.mark.parametrize("changes", [{"activation": "relu"}, {"squashed": True}])
def test_every_kind_of_network_has_its_graph(changes):
    pytest.importorskip("onnx")
    runtime = pytest.importorskip("onnxruntime")
    actor = small_agent(**changes)
    observations = np.random.default_rng(1).normal(size=(5, 22))
    feed = {INPUT: observations.astype(np.float32)}
    (actions,) = runtime.InferenceSession(onnx_bytes(actor)).run([OUTPUT], feed)
    assert actions == pytest.approx(actor.predict(observations)[0], abs=1e-4)


@pytest.mark.parametrize("name", AGENTS)
def test_sb3_loads_the_zip_and_its_statistics(name, tmp_path):
    sb3 = pytest.importorskip("stable_baselines3")
    contrib = pytest.importorskip("sb3_contrib")
    from sb3_models import Spaces
    from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

    actor, path = load_agent(name), tmp_path / "agent.zip"
    run_export(ExportConfig(agent=name, format="sb3", output=path))
    kinds = {"sac": sb3.SAC, "ppo": sb3.PPO, "tqc": contrib.TQC}
    model = kinds[actor.card.algorithm].load(path, device="cpu")
    statistics = VecNormalize.load(str(tmp_path / "agent_vecnormalize.pkl"), DummyVecEnv([Spaces]))
    observations = met(actor)
    normalized = statistics.normalize_obs(observations)
    expected = actor.predict(observations)[0]
    actions = model.predict(normalized, deterministic=True)[0]
    assert np.abs(actions - expected).max() < 1e-4
    found = load_sb3_zip(path).predict(observations, deterministic=True)[0]
    assert np.abs(found - expected).max() < 1e-4


def test_a_zip_of_another_network_than_the_card_says_is_not_written(tmp_path, monkeypatch):
    pytest.importorskip("stable_baselines3")
    actor = load_agent("ppo")
    actor._weights[0] = actor._weights[0][:, :-1]
    monkeypatch.setattr("defmanip_gym.exports.command.load_agent", lambda name: actor)
    with pytest.raises(AgentFileError, match="layers"):
        run_export(ExportConfig(agent="ppo", format="sb3", output=tmp_path / "agent.zip"))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("format_", "suffix"), [("onnx", ".onnx"), ("sb3", ".zip")])
def test_agents_that_are_more_than_their_network_are_refused(format_, suffix, tmp_path):
    path = tmp_path / f"agent{suffix}"
    with pytest.raises(AgentFileError, match="memory"):
        run_export(ExportConfig(agent="residual", format=format_, output=path))
    assert not list(tmp_path.iterdir())


def test_a_suffix_that_nobody_looks_for_is_refused(tmp_path):
    with pytest.raises(ParameterError, match=r"\.zip"):
        ExportConfig(agent="sac", format="sb3", output=tmp_path / "agent.onnx")


def test_without_sb3_the_remedy_is_named(tmp_path):
    words = ["defmanip", "export", "sac", "--format", "sb3", "--output", str(tmp_path / "a.zip")]
    code = f"import sys; sys.modules['stable_baselines3'] = None; sys.argv = {words}; "
    answer = subprocess.run(
        [sys.executable, "-c", f"{code}from defmanip_gym.cli import main; main()"],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert answer.returncode == 2
    assert "defmanip_gym[train]" in "".join(answer.stderr.split())
