"""One row per finished episode; statistics and reports know nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Literal, get_args

from defmanip_gym.envs.registration import ENV_ID
from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.entry import Family
from defmanip_gym.validation import require_choice
from defmanip_gym.version import __version__

Outcome = Literal["success", "violation", "left_workspace", "simulation_failed", "timeout"]


@dataclass(frozen=True, kw_only=True)
class EpisodeRecord:
    """What is kept of one episode.

    Attributes:
        suite: name.
        scenario: name within the suite.
        condition: of the plant; name within the suite.
        contestant: who controlled it.
        family: ``"reference"``, ``"analytic"``, ``"learned"`` or ``"guest"``, a controller that was
            named by ``module:factory``.
        member: seed of the contestant's training, "-" of one that nobody trains.
        seed: of its randomness.
        start: (x, y, θ, q1, q2, φ), m and rad.
        outcome: ``"success"`` reached the goal without ever exceeding σ; ``"violation"`` exceeded
            σ, whatever came later; the others speak for themselves.
        success: whether the outcome is success.
        violated: whether ‖z2‖∞ exceeded σ at any step.
        largest_swing_share: max ‖z2‖∞ / σ, the start included.
        time_to_goal_s: when the goal was reached, also after a violation; None if never.
        duration_s: simulated time until the episode ended.
        start_distance_m: grasp to goal at the start.
        final_distance_m: grasp to goal at the end.
        speed_limit_m_s: of the task.
        peak_grasp_force_n: largest norm of the measured force at the grasp; it carries the object's
            weight too.
        force_error_n: RMS of the measured grasp force minus Eq. (10) of the nominal object at the
            command that took effect.
        energy_j: ∫|F·v| dt of the grasp force on the object and the grasp velocity.
        path_length_m: of the grasp.
        interventions: share of steps in which the filter changed the command; None without one.
        mean_intervention_m_s2: mean change of the command over all steps; None without filter.
        largest_correction_m_s2: its largest change; None without filter.
        correction_reversals_per_s: how often a second the change of the forward command had
            another sign than the change before it, unchanged steps left out; None without filter.
        certificate_applies: whether all that the filter takes for granted held to the end, as the
            wrapper tells; None without filter.
        return_: undiscounted sum of rewards.
        package_version: of defmanip_gym.
        env_id: of the environment.
    """

    suite: str
    scenario: str
    condition: str
    contestant: str
    family: Family
    member: str
    seed: int
    start: tuple[float, ...]
    outcome: Outcome
    success: bool
    violated: bool
    largest_swing_share: float
    time_to_goal_s: float | None
    duration_s: float
    start_distance_m: float
    final_distance_m: float
    speed_limit_m_s: float
    peak_grasp_force_n: float
    force_error_n: float
    energy_j: float
    path_length_m: float
    interventions: float | None
    mean_intervention_m_s2: float | None
    largest_correction_m_s2: float | None
    correction_reversals_per_s: float | None
    certificate_applies: bool | None
    return_: float
    package_version: str = __version__
    env_id: str = ENV_ID

    @property
    def score(self) -> float:
        """Mean speed towards the goal as a share of the speed limit; zero without success."""
        if not self.success or self.time_to_goal_s is None:
            return 0.0
        return self.start_distance_m / (self.time_to_goal_s * self.speed_limit_m_s)

    def to_row(self) -> dict[str, Any]:
        """Return the record as JSON values."""
        return asdict(self)

    @staticmethod
    def from_row(row: object) -> EpisodeRecord:
        """Return the record that ``to_row`` made.

        Raises:
            RecordError: a field is missing, unknown or of the wrong type.
        """
        if not isinstance(row, Mapping) or set(row) != set(_TYPES):
            raise RecordError(
                "record", row, f"an object with the fields {', '.join(_TYPES)}", _REMEDY
            )
        for name, value in row.items():
            if not _fits(value, _TYPES[name]):
                raise RecordError(f"record field {name}", value, _TYPES[name], _REMEDY)
        require_choice("outcome", row["outcome"], get_args(Outcome), RecordError)
        require_choice("family", row["family"], get_args(Family), RecordError)
        return EpisodeRecord(**{**row, "start": tuple(row["start"])})


_REMEDY = "The file was edited or is another program's: delete it, and its episodes run again."
_TYPES = {field.name: str(field.type) for field in fields(EpisodeRecord)}


def _fits(value: object, annotation: str) -> bool:
    """Whether a JSON value fits a field's annotation."""
    for option in annotation.split(" | "):
        match option:
            case "None":
                fits = value is None
            case "bool":
                fits = isinstance(value, bool)
            case "int":
                fits = isinstance(value, int) and not isinstance(value, bool)
            case "float":
                fits = isinstance(value, int | float) and not isinstance(value, bool)
            case "tuple[float, ...]":
                fits = isinstance(value, list | tuple) and all(_fits(x, "float") for x in value)
            case _:
                fits = isinstance(value, str)
        if fits:
            return True
    return False
