"""What one study is made of; the fields are the options of ``defmanip tune``."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal, cast, get_args

from defmanip_gym.envs.registration import ENV_ID, ENV_IDS
from defmanip_gym.errors import ParameterError
from defmanip_gym.training.config import Recipe, TrainConfig
from defmanip_gym.validation import MOST_WORKERS, require_choice, require_whole, settle

_MOST_SEEDS = 100

AnalyticName = Literal["tanner", "oriented", "field", "lqr", "shaped", "mpc"]


@dataclass(frozen=True, kw_only=True)
class TuneConfig:
    """Search for better hyperparameters with Optuna; a second run goes on with the study.

    A trial trains with --seeds seeds for --timesteps steps each and is scored on starts that
    neither training nor any suite uses: the mean over episodes of the share of time left when the
    goal was reached, 0 if it was not. An analytic controller is scored on the same starts in the
    same way and gets as many steps of the environment, --trials times --seeds times --timesteps;
    since it need not train, that makes more trials.

    Examples:
        defmanip tune --algo ppo --trials 20

        defmanip tune --algo tanner

        defmanip tune --algo sac --trials 10 --timesteps 200000 --output runs/tuning

        defmanip tune --algo ppo --env DeformTransport-v1 --filter storage
    """

    algo: Recipe | AnalyticName = "ppo"
    """Recipe whose hyperparameters, or analytic controller whose design choices are varied."""

    env: str = ENV_ID
    """Environment id."""

    filter: str | None = None
    """Let recipes train inside this safety filter; residual has its own protection."""

    trials: int = 20
    """Trials that the study has in the end, those of earlier runs included; of an analytic
    controller, trainings whose steps it may take."""

    timesteps: int = 500_000
    """Environment steps of each training."""

    evaluations: int = 4
    """Evaluations in a trial; after each, trials worse than the median are given up."""

    evaluation_episodes: int = 64
    """Episodes per evaluation."""

    seed: int = 0
    """Of the search, and the first one of every trial's trainings."""

    seeds: int = 3
    """Trainings of a trial, with one seed after the other; its score is their mean, and it is
    given up by the mean so far."""

    jobs: int = 1
    """Processes that take trials from the same study; a joblib backend of yours decides itself.
    What is drawn depends on which trial ends first, if there are several."""

    output: Path = Path("runs/tuning")
    """Folder in which study folders are made."""

    num_threads: int = 0
    """Threads for physics, 0 for one per CPU."""

    def __post_init__(self) -> None:
        require_choice("algo", self.algo, (*get_args(Recipe), *get_args(AnalyticName)))
        require_choice("env", self.env, ENV_IDS)
        if self.is_analytic and self.filter is not None:
            raise ParameterError(
                "filter", self.filter, "None for an analytic controller", "Leave --filter out."
            )
        settle(self, "trials", require_whole, 1)
        settle(self, "timesteps", require_whole, 1)
        settle(self, "seeds", require_whole, 1, _MOST_SEEDS)
        settle(self, "jobs", require_whole, 1, MOST_WORKERS)
        for name in ("filter", "evaluations", "evaluation_episodes", "seed", "num_threads"):
            # which checks the rest
            object.__setattr__(self, name, getattr(self.training(0), name))

    def training(self, number: int) -> TrainConfig:
        """Return how a trial's training of that number trains, counted from 0."""
        return TrainConfig(
            algo="ppo" if self.is_analytic else cast(Recipe, self.algo),
            env=self.env,
            seed=self.seed + number,
            filter=self.filter,
            total_timesteps=self.timesteps,
            evaluations=self.evaluations,
            evaluation_episodes=self.evaluation_episodes,
            num_threads=self.num_threads,
        )

    @property
    def is_analytic(self) -> bool:
        """Whether a controller is tuned that nobody trains."""
        return self.algo in get_args(AnalyticName)

    @property
    def name(self) -> str:
        """Of the study's folder."""
        return "-".join(part for part in (self.env, self.algo, self.filter) if part is not None)

    @property
    def step_budget(self) -> int:
        """Steps of the environment that all trials may take together."""
        return self.trials * self.seeds * self.timesteps

    @property
    def command(self) -> str:
        """The shell command that makes this study."""
        words = ["defmanip tune"]
        for field in fields(self):
            value = getattr(self, field.name)
            if value != field.default and field.name not in ("num_threads", "jobs"):
                words.append(f"--{field.name.replace('_', '-')} {value}")
        return " ".join(words)
