"""A study on disk: which trials it has, and whether it is the one that was asked for."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import FrozenTrial, TrialState

from defmanip_gym.baselines.factories import make_controller
from defmanip_gym.baselines.registry import identity_of, registered_controllers
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import RunFolderError
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.tune_config import TuneConfig
from defmanip_gym.version import __version__

STUDY_FILE = "study.log"

_SETTINGS, _AS_IN_THE_FILE = "settings", "as_in_the_file"
_FINISHED = (TrialState.COMPLETE, TrialState.PRUNED)  # to Optuna, what failed is finished, too
# what Optuna raises for a journal that is not as it wrote it
_DAMAGE = (
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    AssertionError,
    optuna.exceptions.OptunaError,
)


_APART = 100_000  # seeds of processes


def open_study(config: TuneConfig, folder: Path) -> optuna.Study:
    """Return the study of a folder, new or as it was left.

    Raises:
        ParameterError: the recipe's hyperparameters cannot be used.
        RunFolderError: the study is damaged, or was begun with other settings or hyperparameters.
    """
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    settings, path = _settings(config), folder / STUDY_FILE
    try:
        study = optuna.create_study(
            study_name=config.algo,
            storage=_storage(path),
            direction="maximize",
            load_if_exists=True,
        )
        trials, stored = len(study.trials), study.user_attrs.get(_SETTINGS)
    except _DAMAGE as error:
        raise RunFolderError(
            "study",
            str(path),
            "one that defmanip tune wrote",
            f"Choose another --output. It cannot be read: {error!r}",
        ) from error
    if stored is None and trials == 0:
        study.set_user_attr(_SETTINGS, settings)
    elif stored != settings:
        raise RunFolderError(
            "study",
            str(path),
            "one begun with the same settings and hyperparameters",
            f"Choose another --output: {_differences(stored, settings)}.",
        )
    return study


def join_study(config: TuneConfig, folder: Path, drawn: int, process: int) -> optuna.Study:
    """Return an open study for a process that makes trials of it.

    Args:
        config: what the study is made of.
        folder: where it lies.
        drawn: how many trials it had before.
        process: which of those side by side, from 0.
    """
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    # a seed of its own for every start: the sampler would draw the first trials' values again
    seed = config.seed + drawn + process * _APART
    return optuna.load_study(
        study_name=config.algo,
        storage=_storage(folder / STUDY_FILE),
        sampler=optuna.samplers.TPESampler(
            seed=seed, n_startup_trials=5, constant_liar=config.jobs > 1
        ),
        pruner=optuna.pruners.MedianPruner(
            n_startup_trials=4, n_warmup_steps=config.timesteps // 3
        ),
    )


def finished_trials(study: optuna.Study) -> list[FrozenTrial]:
    """Return the trials that were trained to their end or given up as hopeless."""
    return study.get_trials(states=_FINISHED)


def begin_with_the_file(study: optuna.Study) -> None:
    """Let the next trial be the file as it stands, unless one was or will be."""
    kept = study.get_trials(states=(*_FINISHED, TrialState.WAITING))
    if not any(map(is_as_in_the_file, kept)):
        study.enqueue_trial({}, user_attrs={_AS_IN_THE_FILE: True})


def is_as_in_the_file(trial: optuna.Trial | FrozenTrial) -> bool:
    """Tell whether a trial varies nothing."""
    return _AS_IN_THE_FILE in trial.user_attrs


def _settings(config: TuneConfig) -> dict[str, Any]:
    """Return all that a trial's score depends on besides what is varied, as JSON keeps it."""
    names = ("filter", "timesteps", "evaluations", "evaluation_episodes", "seed", "seeds")
    settings = {name: getattr(config, name) for name in names}
    settings |= {"package_version": __version__, "hyperparameters": _varied(config)}
    return json.loads(json.dumps(settings))


def _varied(config: TuneConfig) -> dict[str, Any]:
    """Return what the trials vary some values of."""
    if not config.is_analytic:
        return load_hyperparameters(None, config.algo, config.env)
    reference = registered_controllers()[config.algo]
    identity = identity_of(reference, make_controller(reference, TransportConfig()))
    told = identity["identity"] or {}
    return dict(told.get("params", {}))


def _differences(stored: Any, settings: dict[str, Any]) -> str:
    """Return what differs, by name."""
    if not isinstance(stored, dict):
        return "it does not tell what it was begun with"
    old, new = ({**each, **(each.get("hyperparameters") or {})} for each in (stored, settings))
    return ", ".join(
        f"{name} was {old.get(name)!r} and is {new.get(name)!r}"
        for name in sorted({*old, *new} - {"hyperparameters"})
        if old.get(name) != new.get(name)
    )


def _storage(path: Path) -> JournalStorage:
    """Return a journal's storage; raise one of _DAMAGE for a journal that has lost lines."""
    content = path.read_bytes() if path.exists() else b""
    if content and not content.endswith(b"\n"):  # Optuna would go on in the middle of the line
        raise ValueError("its last line is cut")
    storage = JournalStorage(JournalFileBackend(str(path)))
    if content and not storage.get_all_studies():
        raise ValueError("it holds no study")
    return storage
