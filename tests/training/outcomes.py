"""What a finished training run has come to, as one flat mapping."""

import csv

import numpy as np
from stable_baselines3.common.save_util import load_from_zip_file

from defmanip_gym.training.run_folder import RunFolder
from defmanip_gym.training.state_file import read_state

WALL_CLOCK = ("time/fps", "time/time_elapsed", "time/iterations")


def outcome(folder):
    """Return networks, optimizers, entropy coefficient, state, agents and curves of a run."""
    agents = {path.name: path.read_bytes() for path in folder.glob("*.safetensors")}
    return content(RunFolder(folder).last_checkpoint()) | agents | told("curves", curves(folder))


def content(checkpoint):
    """Return everything that a checkpoint holds but pickled settings."""
    _, parameters, tensors = load_from_zip_file(
        checkpoint / "model.zip", device="cpu", load_data=False
    )
    return (
        told("parameters", parameters)
        | told("tensors", tensors)
        | told("state", read_state(checkpoint))
    )


def told(name, value):
    return {key: leaf for key, leaf in flat(name, value) if not key.endswith(WALL_CLOCK)}


def curves(folder):
    """Return the rows of all parts by step and kind; where parts overlap, the later one counts."""
    rows = {}
    for path in sorted((folder / "curves").rglob("progress.csv")):
        with path.open() as file:
            for row in csv.DictReader(file):
                kind = "evaluation" if row.get("eval/score") else "training"
                told = {name: text for name, text in row.items() if text}
                rows[f"{row['time/total_timesteps']} {kind}"] = told
    return rows


def flat(name, value):
    """Yield the leaves of nested dicts and lists, arrays as bytes."""
    if isinstance(value, dict | list | tuple):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, inner in items:
            yield from flat(f"{name}/{key}", inner)
    else:
        value = value.detach().numpy() if hasattr(value, "detach") else value
        yield name, value.tobytes() if isinstance(value, np.ndarray) else value
