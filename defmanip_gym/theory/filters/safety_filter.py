"""The interface of all safety filters: a wished acceleration in, an allowed one out."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import ActionError, ParameterError
from defmanip_gym.params import RobotParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.validation import number_array

BoolArray = NDArray[np.bool_]

# for which model of the object invariance is proven; "nominal": that a filter rolls out, or that
# has the bounds which its search found
FilterProof = Literal["nonlinear", "nominal", "linear", "none"]


class FilterDecision(NamedTuple):
    """What a filter makes of wished accelerations.

    Attributes:
        allowed_m_s2: the command nearest to the wished one that it allows, (n, 3), base frame.
        margin: how far the deformation may still grow, as a share of what it may be, (n,); what is
            measured differs between filters, negative is outside.
    """

    allowed_m_s2: Array
    margin: Array


class SafetyFilter(ABC):
    """Turns wished task accelerations into allowed ones; itself it has no memory.

    What it has to know of the past of n episodes is in a memory that ``memory`` makes. Attributes:

    * ``name``: by which it is chosen.
    * ``proof``: for which model of the object its promise is proven.
    * ``sigma_rad``: σ that it keeps.
    * ``segment_count``: N of its object.
    * ``robot`` and ``task``: what carries it, under which limits.
    """

    name: str
    proof: FilterProof
    sigma_rad: float
    segment_count: int
    robot: RobotParams
    task: TaskParams

    @property
    @abstractmethod
    def specification(self) -> dict[str, Any]:
        """What the filter was made with, as JSON values: its name and constructor arguments."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SafetyFilter) and self.specification == other.specification

    def __hash__(self) -> int:
        return hash(json.dumps(self.specification, sort_keys=True))

    @abstractmethod
    def covers(self, carried: object) -> bool:
        """Whether its promise holds for this object: ``BeamParams``, or a ``Linkage``."""

    @abstractmethod
    def memory(self, count: int) -> Any:
        """Return the memory of n episodes, an object whose ``remembers`` names its contents."""

    @abstractmethod
    def begin(self, memory: Any, observation: Array, started: BoolArray) -> None:
        """Let episodes start, (n,), with their first observations, (n, size)."""

    @abstractmethod
    def certify_action(self, wished_m_s2: Any, observation: Array, memory: Any) -> FilterDecision:
        """Return what may be commanded instead of the wished accelerations, (n, 3), now.

        Raises:
            ActionError: accelerations that are not finite or of another shape.
            ParameterError: observations of another size.
        """

    @abstractmethod
    def conclude(self, observation: Array, memory: Any) -> Array:
        """Take note of the observations, (n, size), at the end of the period.

        Returns:
            By how much accelerations were others than foreseen, (n, 3) m/s².
        """

    @abstractmethod
    def inside(self, observation: Array, memory: Any) -> BoolArray:
        """Whether the states are where the filter's promise begins to hold, (n,)."""


def require_count(episodes: int, observations: int) -> None:
    """Raise ParameterError unless there are as many observations as a memory has episodes."""
    if episodes != observations:
        raise ParameterError(
            "number of observations",
            observations,
            f"{episodes}, as the memory has episodes",
            "Make the memory with memory(n).",
        )


def finite_accelerations(wished_m_s2: Any, count: int) -> Array:
    """Return accelerations as an array (n, 3).

    Raises:
        ActionError: not finite or of another shape.
    """
    is_ready = isinstance(wished_m_s2, np.ndarray) and wished_m_s2.dtype == np.float64
    values = np.ascontiguousarray(wished_m_s2) if is_ready else number_array(wished_m_s2)
    if values is None or values.shape != (count, 3) or not np.isfinite(values).all():
        raise ActionError(
            "wished acceleration",
            wished_m_s2,
            f"finite numbers of shape {(count, 3)}, m/s²",
            "Give a row for each observation.",
        )
    return values
