"""``defmanip dataset``: write a dataset, or check one."""

from __future__ import annotations

from importlib.metadata import version
from itertools import groupby
from pathlib import Path
from typing import Any

from rich.console import Console

from defmanip_gym.datasets.check import Difference, differences
from defmanip_gym.datasets.collection import environment, episodes_of
from defmanip_gym.datasets.config import DatasetConfig
from defmanip_gym.datasets.minari_access import dataset_root, open_dataset, require_minari
from defmanip_gym.datasets.mixture import Part, common_inner_loop, parts_of
from defmanip_gym.datasets.reference_scores import (
    BEST,
    REFERENCE_EPISODES,
    WORST,
    reference_scores,
)
from defmanip_gym.datasets.writer import new_dataset
from defmanip_gym.display import progress_bar
from defmanip_gym.evaluation.contestant import Contestant
from defmanip_gym.evaluation.contestants import standard_contestants
from defmanip_gym.evaluation.learned_contestants import agent_as_trained
from defmanip_gym.evaluation.protection import Certificates
from defmanip_gym.version import UNKNOWN_REVISION, __version__, git_revision

_MOST_SHOWN = 20


def run_dataset(config: DatasetConfig) -> None:
    """Write a dataset and print where it is, or check one; exits with 1 where that differs.

    Ctrl-C ends it with 130, and leaves no part of a dataset.

    Raises:
        DatasetError: a dataset that is there already, cannot be written, or cannot be checked.
        InstallationError: Minari is not installed.
        ParameterError: unknown contestants, or such as do not go into one dataset.
        AgentFileError: an agent cannot be loaded or does not fit the environment.
    """
    console = Console()
    try:
        if config.check is None:
            folder = write_dataset(config, console)
            console.print(f"Dataset: {folder.resolve()}", soft_wrap=True, highlight=False)
        elif not check_dataset(config.check, dataset_root(config.output), console):
            raise SystemExit(1)
    except KeyboardInterrupt:
        console.print("Stopped; no dataset was written.")
        raise SystemExit(130) from None


def write_dataset(config: DatasetConfig, console: Console) -> Path:
    """Run the episodes, write them, and return the dataset's folder."""
    require_minari()  # before anything takes its time
    assert config.name is not None  # the settings' own check
    contestants = _contestants(config)
    shares = config.shares or (1.0,) * len(contestants)
    parts = parts_of(contestants, shares, config.episodes, config.seed)
    inner_loop = common_inner_loop(contestants)
    env = environment(config.env, inner_loop, config.constraint_mode)
    root = dataset_root(config.output)
    with new_dataset(
        config.name,
        root,
        env,
        algorithm=", ".join(contestant.name for contestant in contestants),
        description=_description(config, parts),
        requirements=[f"defmanip_gym=={__version__}", f"mujoco=={version('mujoco')}"],
        overwrite=config.overwrite,
    ) as writer:
        writer.describe(_metadata(config, parts, inner_loop))
        with progress_bar(console) as progress:
            task = progress.add_task("episodes", total=config.episodes)
            for part in parts:
                done = 0
                for courses in episodes_of(part, env):
                    writer.add(part, part.seeds[done : done + len(courses)], courses)
                    done += len(courses)
                    progress.advance(task, len(courses))
    env.close()
    return root / config.name


def check_dataset(named: str, root: Path, console: Console) -> bool:
    """Simulate a dataset's actions again, print what differs, and return whether nothing does."""
    dataset = open_dataset(named, root)
    found: list[Difference] = []
    parted = 0
    with progress_bar(console) as progress:
        task = progress.add_task("episodes", total=len(dataset.episode_indices))
        for each in differences(dataset):
            found += each
            parted += bool(each)
            progress.advance(task)
    for difference in found[:_MOST_SHOWN]:
        console.print(str(difference), highlight=False, markup=False, soft_wrap=True)
    if len(found) > _MOST_SHOWN:
        console.print(f"and {len(found) - _MOST_SHOWN} more")
    count = len(dataset.episode_indices)
    if found:
        made_with = ", ".join(dataset.storage.metadata.get("requirements", ()))
        console.print(f"{parted} of {count} episodes differ; made with {made_with}.")
    else:
        console.print(f"{count} episodes are the same again, bit for bit.")
    return not found


def _contestants(config: DatasetConfig) -> tuple[Contestant, ...]:
    """Return contestants and agents in the order in which they were named."""
    certificates = Certificates()
    made = standard_contestants(config.contestants, certificates, config.member_limit)
    by_name = {contestant.name: contestant for contestant in made}
    agents = (agent_as_trained(path, certificates) for path in config.agents)
    return (*(by_name[name] for name in config.contestants), *agents)


def _description(config: DatasetConfig, parts: tuple[Part, ...]) -> str:
    said = [
        f"{sum(len(part.seeds) for part in group)} of {name}"
        for name, group in groupby(parts, lambda part: part.contestant.name)
    ]
    return (
        f"{config.episodes} episodes of {config.env}: {', '.join(said)}. Actions are those that "
        "took effect, inside a safety filter the filtered ones; infos begin with the reset's and "
        "hold cost, constraint_margin (rad), is_success and, inside a filter, wished_action. "
        "reset(seed=...) with an episode's seed begins it again."
    )


def _metadata(config: DatasetConfig, parts: tuple[Part, ...], inner_loop: str) -> dict[str, Any]:
    scores = reference_scores(config.env, config.constraint_mode)
    made: dict[str, Any] = {
        "version": __version__,
        "seed": config.seed,
        "inner_loop": inner_loop,
        "constraint_mode": config.constraint_mode,
        "reference_policies": {"min": WORST, "max": BEST},
        "parts": [_told(part) for part in parts],
    }
    revision = git_revision()
    if revision != UNKNOWN_REVISION:
        made["git_revision"] = revision
    return {
        "ref_min_score": scores.worst,
        "ref_max_score": scores.best,
        "num_episodes_average_score": REFERENCE_EPISODES,
        "defmanip_gym": made,
    }


def _told(part: Part) -> dict[str, Any]:
    """Return who controlled, and what that depended on."""
    protection = part.contestant.protection
    return {
        "contestant": part.contestant.name,
        "description": part.contestant.description,
        "member": part.member.name,
        "episodes": len(part.seeds),
        "controller": part.member.controller.identity,
        "safety_filter": None if protection is None else protection.identity,
    }
