"""Controllers as data: what a job carries to the process that runs it, whichever machine it is on.

A controller for a batch of episodes is made where they run, from their seeds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.analytic.tanner import GENTLE_PARAMS
from defmanip_gym.baselines.controller import Controller, RandomController, State, ZeroController
from defmanip_gym.baselines.factories import make_controller
from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.baselines.learned.deployment import controller_of, corrected_by
from defmanip_gym.baselines.learned.sb3_zip import load_sb3_zip
from defmanip_gym.baselines.registry import identity_of
from defmanip_gym.errors import AgentFileError
from defmanip_gym.evaluation.conditions import NOMINAL
from defmanip_gym.theory.certificates import Certificate

Array = NDArray[np.float64]

# Keeps a random policy's draws apart from those that sampled its start.
_POLICY_SEED_OFFSET = 1_000_000_000


class ControllerSpec(Protocol):
    """Says how to make a controller; can be pickled."""

    def build(self, seeds: Sequence[int]) -> Controller:
        """Return the controller for a batch of episodes with these seeds."""
        ...

    @property
    def identity(self) -> dict[str, Any]:
        """What its behaviour depends on, as JSON values."""
        ...


@dataclass(frozen=True)
class Zero:
    """Asks for no acceleration."""

    def build(self, seeds: Sequence[int]) -> Controller:
        """Return the controller."""
        return ZeroController()

    @property
    def identity(self) -> dict[str, Any]:
        """Nothing but its name."""
        return {"controller": "zero"}


@dataclass(frozen=True)
class Random:
    """Draws uniform actions."""

    def build(self, seeds: Sequence[int]) -> Controller:
        """Return a controller with a generator for each episode."""
        return RandomPerEpisode(seeds)

    @property
    def identity(self) -> dict[str, Any]:
        """The generators' seeds are the episodes'."""
        return {"controller": "random", "seed_offset": _POLICY_SEED_OFFSET}


@dataclass(frozen=True)
class Made:
    """What a factory makes for the nominal environment.

    Attributes:
        reference: ``module:factory``.
        certificate: to whose bounds it keeps; None for its own, and for all that take none.
    """

    reference: str
    certificate: Certificate | None = None

    def build(self, seeds: Sequence[int]) -> Controller:
        """Return the controller."""
        return make_controller(self.reference, NOMINAL.environment, self.certificate)

    @property
    def identity(self) -> dict[str, Any]:
        """What it tells of itself; of others' controllers, their source."""
        return identity_of(self.reference, self.build(()))


@dataclass(frozen=True)
class Learned:
    """A trained agent.

    Attributes:
        actor: the network, which travels with the job.
        certificate: to whose bounds the paper's controller under a residual keeps; None if the
            agent is no residual.
    """

    actor: MlpActor
    certificate: Certificate | None = None

    def build(self, seeds: Sequence[int]) -> Controller:
        """Return the controller."""
        return controller_of(self.actor, certificate=self.certificate)

    @property
    def identity(self) -> dict[str, Any]:
        """The network, and what is below a residual."""
        base = None
        if self.certificate is not None:
            base = {"params": asdict(GENTLE_PARAMS), "certificate": asdict(self.certificate)}
        elif (below := corrected_by(self.actor)) is not None:
            base = identity_of(self.actor.card.residual_base, below)
        return {"controller": self.actor.digest, "base": base}


@dataclass(frozen=True)
class Sb3Zip:
    """A model that SB3 saved, unpickled where it runs: only for files that the user trusts.

    Attributes:
        path: of the zip file, absolute; its process must find it there.
        digest: of the model and its normalization.
        normalization: as for ``load_sb3_zip``.
    """

    path: Path
    digest: str
    normalization: str | None = None

    def build(self, seeds: Sequence[int]) -> Controller:
        """Return the controller.

        Raises:
            AgentFileError: the file is gone, or another than when the comparison began.
        """
        controller = load_sb3_zip(self.path, self.normalization)
        if controller.digest != self.digest:
            raise AgentFileError(
                f"digest of {self.path}",
                controller.digest,
                f"{self.digest}, as when the comparison began",
                "The file was replaced meanwhile; run the comparison again.",
            )
        return controller

    @property
    def identity(self) -> dict[str, Any]:
        """The files' contents."""
        return {"controller": self.digest}


class RandomPerEpisode:
    """One random controller per episode, so that no episode's actions depend on its neighbours.

    Args:
        seeds: of the episodes.
    """

    def __init__(self, seeds: Sequence[int]) -> None:
        self._controllers = [RandomController(seed + _POLICY_SEED_OFFSET) for seed in seeds]

    def predict(
        self,
        observation: Array,
        state: State | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[Array, State | None]:
        """Return uniform actions in [-1, 1], (n, 3)."""
        rows = zip(self._controllers, observation, strict=True)
        return np.array([controller.predict(row)[0] for controller, row in rows]), state
