"""Search for hyperparameters with Optuna: ``defmanip tune``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

import optuna
import torch
from filelock import FileLock, Timeout
from optuna.trial import TrialState
from rich.console import Console
from stable_baselines3.common.callbacks import BaseCallback

from defmanip_gym.errors import RunFolderError
from defmanip_gym.files import write_atomically
from defmanip_gym.training.analytic_trials import analytic_objective, steps_taken
from defmanip_gym.training.environments import make_evaluation_env, make_training_env
from defmanip_gym.training.hyperparameters import load_hyperparameters
from defmanip_gym.training.model import build_model, callbacks_of
from defmanip_gym.training.search_spaces import SEARCH_SPACES
from defmanip_gym.training.study import (
    begin_with_the_file,
    finished_trials,
    is_as_in_the_file,
    join_study,
    open_study,
)
from defmanip_gym.training.tune_config import TuneConfig
from defmanip_gym.training.validation_callback import ValidationCallback
from defmanip_gym.workers import running

TABLE_FILE = "trials.md"
_SHOWN = 5  # the best trials of an analytic controller
_MOST_TRIALS = 10_000  # of an analytic controller, if all its gains were given up
_AS_IN_THE_FILE = "as in the file"  # shown of a trial that varies nothing


def run_tune(config: TuneConfig) -> Path:
    """Run what is missing of a study, write its table, and return the table's path.

    Ctrl-C keeps the finished trials and exits with 130 after saying how to go on.

    Raises:
        ParameterError: hyperparameters that cannot be used.
        RunFolderError: the output folder cannot be used, another study writes to it, or its study
            is damaged or was begun with other settings.
    """
    console = Console()
    torch.set_num_threads(1)
    folder = config.output / config.name
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with FileLock(folder / ".lock", timeout=0):
            study = open_study(config, folder)
            table = folder / TABLE_FILE
            _run_missing(config, study, folder)
            write_atomically(table, study_table(study, config).encode())
    except Timeout as error:
        raise RunFolderError(
            "output", str(folder), "a folder that no other study writes to", "Wait."
        ) from error
    except OSError as error:
        raise RunFolderError("output", str(folder), "a writable folder", f"{error}.") from error
    except KeyboardInterrupt:
        console.print(f"Stopped; {folder} keeps finished trials. Go on with the same command.")
        raise SystemExit(130) from None
    if study.get_trials(states=(TrialState.COMPLETE,)):  # else all were given up
        console.print(f"Best: {study.best_params or _AS_IN_THE_FILE} ({study.best_value:.3f})")
    console.print(f"Table: {table}")
    return table


@dataclass(frozen=True, kw_only=True)
class _Share:
    """The trials that one process makes.

    Attributes:
        config: of the study.
        folder: where it lies; other machines must see it, too.
        count: how many trials.
        drawn: how many the study had before.
        number: of the share, from 0.
    """

    config: TuneConfig
    folder: Path
    count: int
    drawn: int
    number: int


def _run_missing(config: TuneConfig, study: optuna.Study, folder: Path) -> None:
    """Make the missing trials, in several processes if that is wanted."""
    missing = config.trials - len(finished_trials(study))
    if config.is_analytic:
        missing = int(_steps_left(config, study) > 0) and _MOST_TRIALS
    if missing <= 0:
        return
    drawn = len(study.trials)
    begin_with_the_file(study)
    counts = [len(range(number, missing, config.jobs)) for number in range(config.jobs)]
    shares = [
        _Share(config=config, folder=folder, count=count, drawn=drawn, number=number)
        for number, count in enumerate(counts)
        if count
    ]
    with running(_take, shares, config.jobs) as results:
        for _ in results:
            pass


def _take(share: _Share) -> None:
    """Make a share of a study's trials."""
    torch.set_num_threads(1)
    config, console = share.config, Console()
    study = join_study(config, share.folder, share.drawn, share.number)

    def tell(study: optuna.Study, trial: optuna.trial.FrozenTrial) -> None:
        value = "given up" if trial.value is None else f"{trial.value:.3f}"
        console.print(f"trial {trial.number}: {value}  {trial.params}", highlight=False)
        if config.is_analytic and _steps_left(config, study) <= 0:
            study.stop()

    study.optimize(
        lambda trial: _objective(config, trial),
        n_trials=share.count,
        callbacks=[tell],
    )


def _steps_left(config: TuneConfig, study: optuna.Study) -> int:
    """Return how many steps of the environment an analytic controller's study still has."""
    return config.step_budget - steps_taken(finished_trials(study))


def _objective(config: TuneConfig, trial: optuna.Trial) -> float:
    if config.is_analytic:
        return analytic_objective(config, trial)
    hyperparameters = load_hyperparameters(None, config.algo, config.env)
    if not is_as_in_the_file(trial):
        hyperparameters |= SEARCH_SPACES[config.algo](trial, hyperparameters)
    scores: list[float] = []
    while len(scores) < config.seeds:
        scores.append(_training_score(config, trial, hyperparameters, scores))
    return fmean(scores)


def _training_score(
    config: TuneConfig, trial: optuna.Trial, hyperparameters: dict[str, Any], earlier: list[float]
) -> float:
    """Return the score of a trial's next training, after ``earlier`` ones.

    Raises:
        TrialPruned: the mean so far is below the median of other trials.
    """
    training = config.training(len(earlier))
    venv = make_training_env(training, hyperparameters)
    model = build_model(config.algo, training.seed, hyperparameters, venv)
    interval = max(1, config.timesteps // config.evaluations // venv.num_envs)
    validation = ValidationCallback(
        make_evaluation_env(training, hyperparameters),
        episodes=config.evaluation_episodes,
        interval=interval,
        on_best=lambda: None,
    )
    watch = _Watch(trial, validation, earlier, len(earlier) * config.timesteps)
    try:
        model.learn(config.timesteps, callback=[*callbacks_of(hyperparameters), validation, watch])
    finally:
        venv.close()
    if watch.pruned:
        raise optuna.TrialPruned()
    return validation.score


class _Watch(BaseCallback):
    """Reports a trial's scores and gives it up if it is hopeless.

    Args:
        trial: whose training this is.
        validation: tells the scores.
        earlier: scores of the trial's trainings before.
        steps: that those took.
    """

    def __init__(
        self,
        trial: optuna.Trial,
        validation: ValidationCallback,
        earlier: list[float],
        steps: int,
    ) -> None:
        super().__init__()
        self.trial, self.validation, self.pruned = trial, validation, False
        self._earlier, self._steps = earlier, steps

    def _on_step(self) -> bool:
        if self.validation.n_calls % self.validation.eval_freq == 0:
            mean = fmean((*self._earlier, self.validation.score))
            self.trial.report(mean, self._steps + self.num_timesteps)
            self.pruned = self.trial.should_prune()
        return not self.pruned


def study_table(study: optuna.Study, config: TuneConfig) -> str:
    """Return finished trials as a Markdown table, the best first; of many, the best and the first.

    An analytic controller's study has hundreds.
    """
    trials = sorted(
        finished_trials(study),
        key=lambda trial: (trial.value is None, -(trial.value or 0.0)),
    )
    count = len(trials)
    if config.is_analytic:
        trials = [t for rank, t in enumerate(trials) if rank < _SHOWN or is_as_in_the_file(t)]
    names = sorted({name for trial in trials for name in trial.params})
    header = ["trial", "score", *names]
    made = f"`{config.command}`: {count} trials"
    if config.is_analytic:
        made += f", {steps_taken(finished_trials(study)):,} steps"
    lines = [made, "", _row(header), _row(["---"] * len(header))]
    for trial in trials:
        value = "given up" if trial.value is None else f"{trial.value:.3f}"
        cells = [_cell(trial.params.get(name)) for name in names]
        lines.append(_row([str(trial.number), value, *cells]))
    return "\n".join([*lines, ""])


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(value: Any) -> str:
    if value is None:
        return _AS_IN_THE_FILE
    return f"{value:.3g}" if isinstance(value, float) else str(value)
