"""From finished runs to the library of shipped agents; all is checked before anything is copied."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from defmanip_gym.baselines.learned.actor import CARD_SUFFIX, TENSOR_SUFFIX, MlpActor, load_actor
from defmanip_gym.baselines.learned.agents import RUN_AGENT
from defmanip_gym.baselines.learned.families import (
    family_seeds,
    load_member,
    member_name,
    require_alike,
)
from defmanip_gym.envs.registration import (
    ENV_ID,
    QUICK_ENV_ID,
    RANDOMIZED_ENV_ID,
    ROBUST_ENV_ID,
)
from defmanip_gym.errors import RunFolderError
from defmanip_gym.files import write_atomically
from defmanip_gym.training.run_folder import LAST_AGENT, RunFolder
from defmanip_gym.training.ship_config import ShipConfig

# what a family's name says of the environment that it learned in
_WHERE = {
    ENV_ID: (),
    RANDOMIZED_ENV_ID: ("randomized",),
    QUICK_ENV_ID: ("v1",),
    ROBUST_ENV_ID: ("randomized", "v1"),
}


@dataclass(frozen=True, kw_only=True)
class _Finished:
    """A run that may be shipped: its folder, its best agent, and where that belongs."""

    path: Path
    agent: MlpActor
    family: str

    @property
    def name(self) -> str:
        return f"{self.family}/{member_name(self.agent.card.seed)}"


def run_ship(config: ShipConfig) -> None:
    """Ship runs and print their names."""
    for name in ship(config):
        print(f"Shipped: {name}")


def ship(config: ShipConfig) -> tuple[str, ...]:
    """Copy the best agent of each run into the library and return the agents' names.

    Raises:
        RunFolderError: a run that is unfinished, was started from changed sources, or is named
            twice, or a library that cannot be written.
        AgentFileError: an agent that is damaged, or does not go with its family's others.
    """
    runs: dict[str, _Finished] = {}
    for path in config.runs:
        run = _finished(path)
        if run.name in runs:
            raise RunFolderError(
                "runs",
                [str(runs[run.name].path), str(path)],
                f"one run for {run.name}",
                "Name the one to be shipped.",
            )
        runs[run.name] = run
    _check_families(runs, config.library)
    for name, run in runs.items():
        for suffix in (TENSOR_SUFFIX, CARD_SUFFIX):
            target = config.library / f"{name}{suffix}"
            try:
                content = (run.path / f"{RUN_AGENT}{suffix}").read_bytes()
                write_atomically(target, content)
            except OSError as error:
                raise RunFolderError(
                    "library", str(target), "a file that can be written", f"{error}."
                ) from error
    return tuple(runs)


def _finished(path: Path) -> _Finished:
    """Return a run with its agent; raise RunFolderError unless it may be shipped."""
    stored = RunFolder(path).read_config()
    agent, last = (load_actor(path / name) for name in (RUN_AGENT, LAST_AGENT))
    planned = stored.train.total_timesteps or stored.hyperparameters["n_timesteps"]
    if last.card.total_timesteps < planned:
        raise RunFolderError(
            f"steps of {path}",
            last.card.total_timesteps,
            f"{int(planned)}, as planned",
            f"Finish it: python train.py --resume {path}",
        )
    revision = agent.card.git_revision
    if revision == "unknown" or "dirty" in revision:
        raise RunFolderError(
            f"git revision of {path}",
            revision,
            "a commit without changes",
            "Nobody could repeat this run: commit, and train again.",
        )
    parts = [agent.card.recipe, stored.train.trained_inside, *_WHERE[agent.card.env_id]]
    return _Finished(path=path, agent=agent, family="-".join(filter(None, parts)))


def _check_families(runs: Mapping[str, _Finished], library: Path) -> None:
    """Raise AgentFileError unless old and new members of each family go together."""
    for family in {run.family for run in runs.values()}:
        new = [run.agent for run in runs.values() if run.family == family]
        seeds = {agent.card.seed for agent in new}
        kept = [
            load_member(family, member_name(seed), library)
            for seed in family_seeds(family, library)
            if seed not in seeds
        ]
        require_alike((*kept, *new), library / family)
