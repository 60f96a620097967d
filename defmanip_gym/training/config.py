"""What one training run is made of; the fields are the options of ``train.py``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import yaml

from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import ParameterError
from defmanip_gym.evaluation.scenarios import FIRST_EVALUATION_SEED
from defmanip_gym.validation import require_choice, require_non_negative, require_whole

Algorithm = Literal["ppo", "sac", "td3"]

HYPERPARAMETERS = Path(__file__).parents[1] / "baselines" / "learned" / "hyperparams"


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """Train an SB3 agent on DeformTransport through the batched environment.

    Examples:
        python train.py --algo ppo --total-timesteps 3000000 --seed 0

        python train.py --algo sac --certificate l1

        python train.py --resume runs/DeformTransport-v0-ppo-seed0
    """

    algo: Algorithm = "ppo"
    """Learning algorithm."""

    env: str = ENV_ID
    """Environment id."""

    total_timesteps: int | None = None
    """Environment steps; the hyperparameter file's n_timesteps by default."""

    seed: int = 0
    """Seed of networks, exploration and starts, below 1,000,000."""

    certificate: Literal["l1", "tanner"] | None = None
    """Train inside NuMaxActionScaling with this certificate for the true beam."""

    resume: Path | None = None
    """Run folder to continue; every other option but --total-timesteps is taken from it."""

    output: Path = Path("runs")
    """Folder in which run folders are made."""

    hyperparameters: Path | None = None
    """YAML file in rl-zoo3's format; the package's own by default."""

    evaluations: int = 20
    """Evaluations and checkpoints over the run."""

    evaluation_episodes: int = 32
    """Episodes per evaluation."""

    def __post_init__(self) -> None:
        require_choice("algo", self.algo, ("ppo", "sac", "td3"))
        require_choice("env", self.env, (ENV_ID, f"defmanip_gym:{ENV_ID}"))
        if self.total_timesteps is not None:
            require_whole("total_timesteps", self.total_timesteps, 1)
        require_non_negative("seed", self.seed)
        require_whole("evaluations", self.evaluations, 1)
        require_whole("evaluation_episodes", self.evaluation_episodes, 1)
        if self.seed >= FIRST_EVALUATION_SEED:
            raise ParameterError(
                "seed",
                self.seed,
                f"0 <= seed < {FIRST_EVALUATION_SEED}",
                "Seeds above are kept for evaluation.",
            )


def load_hyperparameters(path: Path | None, algo: Algorithm) -> dict[str, Any]:
    """Return the hyperparameters of ``DeformTransport-v0`` in an rl-zoo3 YAML file.

    Raises:
        ParameterError: the file is missing, not YAML, or has no entry for the environment.
    """
    path = path or HYPERPARAMETERS / f"{algo}.yml"
    try:
        content = yaml.safe_load(path.read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ParameterError(
            "hyperparameters", str(path), "a readable YAML file", f"{error}"
        ) from error
    if not isinstance(content, dict) or not isinstance(content.get(ENV_ID), dict):
        raise ParameterError(
            "hyperparameters", str(path), f"a mapping with the key {ENV_ID}", "See the package's."
        )
    return checked_hyperparameters(content[ENV_ID], str(path))


def checked_hyperparameters(hyperparameters: dict[str, Any], source: str) -> dict[str, Any]:
    """Return hyperparameters that have what training needs.

    Raises:
        ParameterError: an entry is missing.
    """
    missing = {"n_envs", "n_timesteps", "policy", "learning_rate"} - set(hyperparameters)
    if missing:
        raise ParameterError(
            "hyperparameters",
            source,
            "n_envs, n_timesteps, policy, learning_rate and the algorithm's own",
            f"It lacks {', '.join(sorted(missing))}.",
        )
    return dict(hyperparameters)
