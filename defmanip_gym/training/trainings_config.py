"""Settings of ``defmanip trainings``; their docstrings are the command line's help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.training.config import Recipe, TrainConfig
from defmanip_gym.validation import MOST_WORKERS, require_whole, settle


@dataclass(frozen=True, kw_only=True)
class TrainingsConfig:
    """Train recipes with several seeds each, side by side; what is there is kept or gone on with.

    Each training is a run folder as train.py makes it. One that was interrupted goes on from its
    last checkpoint, whichever process takes it: the same command again, or, on a cluster that is
    joblib's backend, another worker.

    Examples:
        defmanip trainings --algos ppo sac --seeds 0 1 2

        defmanip trainings --algos sac --filter storage --jobs 2
    """

    algos: tuple[Recipe, ...] = ("ppo", "residual", "lagrangian", "sac", "tqc")
    """Recipes to train."""

    seeds: tuple[int, ...] = (0, 1, 2, 3, 4)
    """Seeds of each."""

    env: str = ENV_ID
    """Environment id."""

    filter: str | None = None
    """Train inside this safety filter; residual has its own protection and is left without."""

    total_timesteps: int | None = None
    """Environment steps of each; the hyperparameter file's n_timesteps by default."""

    output: Path = Path("runs")
    """Folder in which run folders are made; workers on other machines must see it."""

    hyperparameters: Path | None = None
    """YAML file for all recipes; the package's own by default."""

    evaluations: int = 15
    """Evaluations on the validation starts, and checkpoints, over each run."""

    evaluation_episodes: int = 64
    """Episodes per evaluation."""

    jobs: int | None = None
    """Trainings at a time, as many as cores by default; a joblib backend of yours decides
    itself."""

    num_threads: int = 1
    """Threads for physics in each."""

    def __post_init__(self) -> None:
        if self.jobs is not None:
            settle(self, "jobs", require_whole, 1, MOST_WORKERS)
        _ = self.runs  # checks the rest

    @property
    def runs(self) -> tuple[TrainConfig, ...]:
        """How each is trained, the seeds of a recipe together."""
        return tuple(
            TrainConfig(
                algo=algo,
                env=self.env,
                seed=seed,
                filter=None if algo == "residual" else self.filter,
                total_timesteps=self.total_timesteps,
                output=self.output,
                hyperparameters=self.hyperparameters,
                evaluations=self.evaluations,
                evaluation_episodes=self.evaluation_episodes,
                num_threads=self.num_threads,
            )
            for algo in dict.fromkeys(self.algos)
            for seed in dict.fromkeys(self.seeds)
        )
