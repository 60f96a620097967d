"""What a contestant is: controllers, and the safety filter around them."""

from __future__ import annotations

from dataclasses import dataclass

from defmanip_gym.envs.config import InnerLoopKind
from defmanip_gym.evaluation.controllers import ControllerSpec
from defmanip_gym.evaluation.entry import Family
from defmanip_gym.evaluation.protection import Protection
from defmanip_gym.theory.certificates import Certificate


@dataclass(frozen=True, kw_only=True)
class Member:
    """One of a contestant's controllers: of a learned one, the result of one training.

    Attributes:
        name: seed of the training; ``SOLE_MEMBER`` where there is none or nobody knows it.
        controller: how to make it.
    """

    name: str
    controller: ControllerSpec


@dataclass(frozen=True, kw_only=True)
class Contestant:
    """A controller in a comparison, with the safety filter around it.

    Attributes:
        name: unique; a part after a slash names the filter.
        family: what kind of controller it is.
        description: one sentence for the report.
        privileged: what it knows beyond the observation.
        colour: of its lines in plots, ``#rrggbb``.
        members: its controllers; one unless it was trained several times.
        protection: the safety filter around the environment; None runs without one.
        inner_loop: between the task acceleration and the forces.
    """

    name: str
    family: Family
    description: str
    privileged: str
    colour: str
    members: tuple[Member, ...]
    protection: Protection | None = None
    inner_loop: InnerLoopKind = "model"

    @property
    def name_alone(self) -> str:
        """Its name without the filter."""
        method = "" if self.protection is None else self.protection.method
        return self.name.removesuffix(f"/{method}")

    @property
    def certificate(self) -> Certificate | None:
        """The certificate that is enforced, if the filter is one."""
        return None if self.protection is None else self.protection.certificate
