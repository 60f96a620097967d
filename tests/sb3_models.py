"""SB3 models of nothing but spaces, and zip files that do what they should not."""

import base64
import json
import os
import zipfile

import cloudpickle
import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize


class Spaces(gymnasium.Env):
    """Nothing but spaces."""

    def __init__(self, observation_shape=(22,), limit=1.0):
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, observation_shape)
        self.action_space = gymnasium.spaces.Box(-limit, limit, (3,))

    def reset(self, *, seed=None, options=None):
        return np.zeros(self.observation_space.shape, np.float32), {}

    def step(self, action):
        return self.reset()[0], 0.0, False, False, {}


class Turning(Spaces):
    """Observations with a heading, as the environment's, and noise elsewhere."""

    def reset(self, *, seed=None, options=None):
        self.generator = np.random.default_rng(seed)
        return self.observation(), {}

    def step(self, action):
        return self.observation(), 0.0, False, False, {}

    def observation(self):
        observation, angle = self.generator.normal(2.0, 3.0, 22), self.generator.normal()
        observation[3:5] = np.sin(angle), np.cos(angle)
        return observation.astype(np.float32)


class Payload:
    """Unpickling it makes a folder."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return os.mkdir, (str(self.path),)


def saved(path, algorithm=PPO, env=None):
    model = algorithm("MlpPolicy", env or Spaces(), device="cpu", policy_kwargs={"net_arch": [8]})
    model.save(path)
    return model


def trained(algorithm, normalization=None, callback=None):
    """Train for some steps, inside VecNormalize with these arguments, if any."""
    env = DummyVecEnv([Turning])
    if normalization is not None:
        env = VecNormalize(env, **normalization)
    options = {"n_steps": 8, "batch_size": 8} if algorithm is PPO else {"learning_starts": 8}
    kwargs = {"policy_kwargs": {"net_arch": [8]}, "device": "cpu"} | options
    model = algorithm("MlpPolicy", env, **kwargs)
    model.learn(16, callback=callback)
    return model


def poisoned(path, trace):
    """Save a model that makes the folder ``trace`` when it is loaded."""
    saved(path)
    with zipfile.ZipFile(path) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    data = json.loads(content["data"])
    pickled = base64.b64encode(cloudpickle.dumps(Payload(trace))).decode()
    data["lr_schedule"] = {":type:": "x", ":serialized:": pickled}
    with zipfile.ZipFile(path, "w") as archive:
        for name, part in (content | {"data": json.dumps(data)}).items():
            archive.writestr(name, part)
