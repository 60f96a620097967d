"""The command line, ``defmanip``; ``train.py`` and ``evaluate.py`` are single commands of it."""

from __future__ import annotations

import inspect
import os
import sys
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

import tyro
from rich.console import Console
from rich.markup import escape

from defmanip_gym.catalogue.config import AgentsConfig
from defmanip_gym.certification.config import CertifyConfig
from defmanip_gym.datasets.config import DatasetConfig
from defmanip_gym.errors import DefmanipError, InstallationError
from defmanip_gym.evaluation.comparison import ComparisonConfig, run_comparison
from defmanip_gym.exports.config import ExportConfig
from defmanip_gym.oracle.config import PlanConfig
from defmanip_gym.reproduction.config import ReproductionConfig
from defmanip_gym.training.config import TrainConfig
from defmanip_gym.training.ship_config import ShipConfig
from defmanip_gym.training.trainings_config import TrainingsConfig
from defmanip_gym.training.tune_config import TuneConfig

Config = TypeVar("Config")


def main() -> None:
    """Entry point of ``defmanip``."""
    commands: dict[str, Callable[..., Any]] = {
        "train": TrainConfig,
        "trainings": TrainingsConfig,
        "tune": TuneConfig,
        "compare": ComparisonConfig,
        "certify": CertifyConfig,
        "reproduce": ReproductionConfig,
        "agents": AgentsConfig,
        "plan": PlanConfig,
        "dataset": DatasetConfig,
        "export": ExportConfig,
        "ship": ShipConfig,
    }
    _guarded(
        lambda: _run(
            tyro.extras.subcommand_cli_from_dict(
                commands,
                prog="defmanip",
                description="Certified transport of deformable objects.",
            )
        )
    )


def train_main() -> None:
    """Entry point of ``train.py``."""
    _guarded(lambda: _run(_parsed(TrainConfig, "train.py")))


def evaluate_main() -> None:
    """Entry point of ``evaluate.py``."""
    _guarded(lambda: _run(_parsed(ComparisonConfig, "evaluate.py")))


def _parsed(kind: type[Config], program: str) -> Config:
    """Return the options of a one-command program; its help shows the class's examples."""
    return tyro.cli(kind, prog=program, description=inspect.getdoc(kind))


def _run(config: object) -> None:
    if isinstance(config, ComparisonConfig):
        run_comparison(config)
    elif isinstance(config, TrainConfig | TrainingsConfig | TuneConfig | ShipConfig | ExportConfig):
        _run_training(config)
    elif isinstance(config, CertifyConfig):
        from defmanip_gym.certification.command import run_certify  # matplotlib takes its time

        run_certify(config)
    elif isinstance(config, ReproductionConfig):
        from defmanip_gym.reproduction.reproduce import run_reproduction  # as above

        run_reproduction(config)
    elif isinstance(config, AgentsConfig):
        from defmanip_gym.catalogue.command import run_agents

        run_agents(config)
    elif isinstance(config, DatasetConfig):
        from defmanip_gym.datasets.command import run_dataset

        run_dataset(config)
    elif isinstance(config, PlanConfig):
        from defmanip_gym.oracle.command import run_plan

        run_plan(config)


def _run_training(
    config: TrainConfig | TrainingsConfig | TuneConfig | ShipConfig | ExportConfig,
) -> None:
    """Run a command that imports torch and others, which take seconds and need not be there."""
    try:
        if isinstance(config, TrainConfig):
            from defmanip_gym.training.train import train

            print(f"Run folder: {train(config)}")
        elif isinstance(config, TrainingsConfig):
            from defmanip_gym.training.trainings import run_trainings

            run_trainings(config)
        elif isinstance(config, TuneConfig):
            from defmanip_gym.training.tuning import run_tune

            run_tune(config)
        elif isinstance(config, ExportConfig):
            from defmanip_gym.exports.command import run_export

            run_export(config)
        else:
            from defmanip_gym.training.shipping import run_ship

            run_ship(config)
    except ModuleNotFoundError as error:
        raise InstallationError(
            "the module that training needs",
            error.name,
            "one that is installed",
            "Install it with: pip install 'defmanip_gym[train]'.",
        ) from error


def _guarded(command: Callable[[], None]) -> None:
    """Show this package's own errors as messages, and end quietly when nobody reads on."""
    # whoever asks for v0 means it
    warnings.filterwarnings("ignore", message=".*DeformTransport.* is out of date")
    try:
        try:
            command()
        finally:
            sys.stdout.flush()  # a closed pipe shows here, not when the interpreter ends
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the last flush
        sys.exit(141)  # as a shell reports a program that SIGPIPE ended
    except DefmanipError as error:
        Console(stderr=True).print(
            f"[bold red]{type(error).__name__}[/]: {escape(str(error))}", highlight=False
        )
        sys.exit(2)
