"""Who takes part in the standard comparison, and what each knows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.controller import Controller, RandomController, State, ZeroController
from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.baselines.tanner import TannerController
from defmanip_gym.params import DESIGN_DAMPING, BeamParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, Certificate, certify

Array = NDArray[np.float64]

SHIPPED_AGENT = "ppo"

# Keeps a random policy's draws apart from those that sampled its start.
_POLICY_SEED_OFFSET = 1_000_000_000


@dataclass(frozen=True, kw_only=True)
class Contestant:
    """A controller in a comparison.

    Attributes:
        name: unique; a part after a slash names the certificate.
        description: one sentence for the report.
        privileged: what it knows beyond the observation.
        colour: of its lines in plots, ``#rrggbb``.
        build: makes the controller for a batch of episodes, given their seeds.
        certificate: enforced on it by the ν_max wrapper; None runs it without the wrapper.
    """

    name: str
    description: str
    privileged: str
    colour: str
    build: Callable[[Sequence[int]], Controller]
    certificate: Certificate | None = None


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


def default_contestants(beam: BeamParams, sigma_rad: float) -> tuple[Contestant, ...]:
    """Return the contestants of the standard comparison.

    Args:
        beam: the plant's true beam; also what the analytic controllers know.
        sigma_rad: σ, which the certificates guard.

    Raises:
        CertificateError: σ or the beam leaves no room for a certificate.
    """
    design_beam = replace(beam, damping=DESIGN_DAMPING)
    l1 = certify(beam, sigma_rad=sigma_rad, method="l1", conditions=TRANSPORT_CONDITIONS)
    tanner = certify(
        design_beam, sigma_rad=sigma_rad, method="tanner", conditions=TRANSPORT_CONDITIONS
    )
    return (
        Contestant(
            name="zero",
            description="Asks for no acceleration; only the disturbance moves it.",
            privileged="nothing",
            colour="#8c8c8c",
            build=lambda seeds: ZeroController(),
        ),
        Contestant(
            name="random",
            description="Draws uniform actions.",
            privileged="nothing",
            colour="#b08968",
            build=RandomPerEpisode,
        ),
        Contestant(
            name="tanner/tanner",
            description=(
                "The paper's cascade under the paper's bound, Eq. (18), for its design damping of "
                f"{DESIGN_DAMPING:g} N·m·s/rad: grasp acceleration within "
                f"{tanner.acceleration_bound:.2g} m/s². As in the paper the plant has less damping "
                f"({beam.damping:g}), so this certificate is not proven for it."
            ),
            privileged="robot and beam parameters; a damping that is not the plant's",
            colour="#1b3a6b",
            build=lambda seeds: TannerController(beam=beam, certificate=tanner),
            certificate=tanner,
        ),
        Contestant(
            name="tanner/l1",
            description=(
                "The same cascade under the exact linear bound for the plant's own damping: grasp "
                f"acceleration within {l1.acceleration_bound:.2g} m/s²."
            ),
            privileged="robot and beam parameters, the true damping among them",
            colour="#2f7fc1",
            build=lambda seeds: TannerController(beam=beam, certificate=l1),
            certificate=l1,
        ),
        Contestant(
            name="tanner/none",
            description="The same cascade with neither certificate nor wrapper.",
            privileged="robot and beam parameters",
            colour="#45b5aa",
            build=lambda seeds: TannerController(beam=beam),
        ),
        Contestant(
            name="ppo",
            description="The shipped PPO agent, trained in simulation without the disturbance.",
            privileged="nothing; its training saw the true plant",
            colour="#e07b39",
            build=_shipped_agent,
        ),
        Contestant(
            name="ppo/l1",
            description="The same agent inside the ν_max wrapper with the l1 certificate.",
            privileged="as ppo; the wrapper knows the beam's parameters",
            colour="#b3293b",
            build=_shipped_agent,
            certificate=l1,
        ),
    )


def agent_contestants(path: Path, beam: BeamParams, sigma_rad: float) -> tuple[Contestant, ...]:
    """Return an agent of the user's, without and with the ν_max wrapper.

    Its name ends in a digest of the agent, so that records of another never pass for its own.

    Raises:
        AgentFileError: the agent cannot be loaded.
        CertificateError: σ or the beam leaves no room for a certificate.
    """
    agent = load_agent(path)
    folder = path.resolve() if path.is_dir() else path.resolve().parent
    name = f"{folder.name}@{agent.digest}"
    l1 = certify(beam, sigma_rad=sigma_rad, method="l1", conditions=TRANSPORT_CONDITIONS)
    plain = Contestant(
        name=name,
        description=f"{agent.card.algorithm} agent made by `{agent.card.command}`.",
        privileged="nothing; its training saw the true plant",
        colour="#7a5195",
        build=lambda seeds: agent,
    )
    wrapped = replace(
        plain,
        name=f"{name}/l1",
        description="The same agent inside the ν_max wrapper with the l1 certificate.",
        privileged="the wrapper knows the beam's parameters",
        colour="#c77dba",
        certificate=l1,
    )
    return plain, wrapped


def _shipped_agent(seeds: Sequence[int]) -> Controller:
    return load_agent(SHIPPED_AGENT)
