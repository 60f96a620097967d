"""SB3 models of nothing but spaces, and zip files that do what they should not."""

import base64
import json
import os
import zipfile

import cloudpickle
import gymnasium
import numpy as np
from stable_baselines3 import PPO


class Spaces(gymnasium.Env):
    """Nothing but spaces."""

    def __init__(self, observation_shape=(22,), limit=1.0):
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, observation_shape)
        self.action_space = gymnasium.spaces.Box(-limit, limit, (3,))

    def reset(self, *, seed=None, options=None):
        return np.zeros(self.observation_space.shape, np.float32), {}

    def step(self, action):
        return self.reset()[0], 0.0, False, False, {}


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
