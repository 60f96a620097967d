"""What one training run is made of; the fields are the options of ``train.py``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from defmanip_gym.envs.registration import ENV_ID, ENV_IDS
from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.seeds import FIRST_EVALUATION_SEED
from defmanip_gym.theory.filters.family import STORAGE_FILTERS
from defmanip_gym.validation import MOST_WORKERS, require_choice, require_whole, settle

Recipe = Literal["ppo", "sac", "tqc", "residual", "lagrangian"]
Method = Literal["l1", "phase_plane", "tanner"]

# what learns in each recipe
ALGORITHM_OF = {"ppo": "ppo", "sac": "sac", "tqc": "tqc", "residual": "ppo", "lagrangian": "ppo"}


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """Train an SB3 agent on DeformTransport through the batched environment.

    Examples:
        python train.py --algo ppo --total-timesteps 3000000 --seed 0

        python train.py --algo residual --seed 3

        python train.py --algo ppo --env DeformTransportRandomized-v0

        python train.py --algo sac --filter storage

        python train.py --algo sac --certificate l1

        python train.py --resume runs/DeformTransport-v0-ppo-seed0
    """

    algo: Recipe = "ppo"
    """Learning algorithm; residual (PPO that corrects the paper's controller inside a certificate)
    and lagrangian (PPO with an adapting price on violations) are among them."""

    env: str = ENV_ID
    """Environment id; DeformTransportRandomized-v0 draws every episode's damping and mass."""

    total_timesteps: int | None = None
    """Environment steps; the hyperparameter file's n_timesteps by default."""

    seed: int = 0
    """Seed of networks, exploration and starts, below 1,000,000."""

    certificate: Method | None = None
    """Train inside NuMaxActionScaling with this certificate for the true beam; residual has its
    own."""

    filter: str | None = None
    """Train inside this safety filter, such as storage, made for the true beam (or all that are
    drawn) and robot; not together with a certificate."""

    resume: Path | None = None
    """Run folder to continue; every other option but --total-timesteps is taken from it."""

    output: Path = Path("runs")
    """Folder in which run folders are made."""

    hyperparameters: Path | None = None
    """YAML file in rl-zoo3's format; the package's own by default."""

    evaluations: int = 15
    """Evaluations on the validation starts, and checkpoints, over the run."""

    evaluation_episodes: int = 64
    """Episodes per evaluation."""

    num_threads: int = 0
    """Threads for physics, 0 for one per CPU; 1 is best where several runs share a machine."""

    def __post_init__(self) -> None:
        require_choice("algo", self.algo, get_args(Recipe))
        require_choice("env", self.env, (*ENV_IDS, *(f"defmanip_gym:{id_}" for id_ in ENV_IDS)))
        if self.certificate is not None:
            require_choice("certificate", self.certificate, get_args(Method))
        if self.filter is not None:
            require_choice("filter", self.filter, tuple(STORAGE_FILTERS))
        self._require_one_protection()
        if self.total_timesteps is not None:
            settle(self, "total_timesteps", require_whole, 1)
        settle(self, "seed", require_whole, 0)
        settle(self, "evaluations", require_whole, 1)
        settle(self, "evaluation_episodes", require_whole, 1)
        settle(self, "num_threads", require_whole, 0, MOST_WORKERS)
        if self.seed >= FIRST_EVALUATION_SEED:
            raise ParameterError(
                "seed",
                self.seed,
                f"0 <= seed < {FIRST_EVALUATION_SEED}",
                "Seeds above are kept for evaluation.",
            )

    def _require_one_protection(self) -> None:
        """Raise ParameterError if a certificate or filter is asked for beside another."""
        if self.algo == "residual" and self.trained_inside is not None:
            raise ParameterError(
                "certificate" if self.certificate is not None else "filter",
                self.trained_inside,
                "none with --algo residual",
                "Its hyperparameter file names the certificate.",
            )
        if self.certificate is not None and self.filter is not None:
            raise ParameterError(
                "filter",
                self.filter,
                f"none beside --certificate {self.certificate}",
                "Train inside one of them: what one allows, the other would change.",
            )

    @property
    def trained_inside(self) -> str | None:
        """Name of the certificate or filter around the training, or None."""
        return self.filter if self.certificate is None else self.certificate

    @property
    def env_id(self) -> str:
        """The environment id without a module to import."""
        return self.env.split(":")[-1]
