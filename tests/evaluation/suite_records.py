"""Records of whole suites and their contestants, made by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from episodes import record

from defmanip_gym.evaluation.contestant import Contestant, Member
from defmanip_gym.evaluation.controllers import Zero
from defmanip_gym.evaluation.entry import SOLE_MEMBER
from defmanip_gym.evaluation.protection import Protection
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.statistics.episode_table import EpisodeTable, tabulate


def contestant(
    name: str,
    family: str,
    *,
    protection: Protection | None = None,
    members: tuple[str, ...] = (SOLE_MEMBER,),
    description: str = "Does something.",
) -> Contestant:
    return Contestant(
        name=name,
        family=family,
        description=description,
        privileged="nothing",
        colour="#aa3300",
        members=tuple(Member(name=member, controller=Zero()) for member in members),
        protection=protection,
    )


def suite_records(
    scores: Mapping[str, np.ndarray],
    *,
    suite: str = "nominal",
    conditions: Sequence[str] | None = None,
) -> list[EpisodeRecord]:
    """Return records with these scores, (members, scenarios) for each contestant; 0 is a failure.

    Contestants named tanner are analytic, zero and random references, all others learned.
    """
    records = []
    for contestant, matrix in scores.items():
        matrix = np.atleast_2d(matrix)
        labels = conditions or ["nominal"] * matrix.shape[1]
        for row, member_scores in enumerate(matrix):
            member = str(row) if len(matrix) > 1 else SOLE_MEMBER
            for column, score in enumerate(member_scores.tolist()):
                records.append(
                    _episode(
                        score,
                        suite=suite,
                        scenario=f"{labels[column]}-{column:02d}",
                        condition=labels[column],
                        contestant=contestant,
                        family=_family(contestant),
                        member=member,
                    )
                )
    return records


def table(
    contestant: str, scores: np.ndarray, conditions: Sequence[str] | None = None
) -> EpisodeTable:
    (made,) = tabulate(suite_records({contestant: scores}, conditions=conditions), "nominal")
    return made


def _family(contestant: str) -> str:
    base = contestant.partition("/")[0]
    if base in ("zero", "random"):
        return "reference"
    return "analytic" if base.startswith("tanner") else "learned"


def _episode(score: float, **names: object) -> EpisodeRecord:
    wrapped = "/" in str(names["contestant"])
    of_wrapper = {
        "interventions": 0.2 if wrapped else None,
        "mean_intervention_m_s2": 0.05 if wrapped else None,
        "largest_correction_m_s2": 0.5 if wrapped else None,
        "correction_reversals_per_s": 1.5 if wrapped else None,
        "certificate_applies": True if wrapped else None,
    }
    if score == 0.0:
        ending = {"outcome": "timeout", "success": False, "time_to_goal_s": None}
    else:
        time_s = 10.0 / (score * 2.0)  # 10 m at the limit of 2 m/s
        ending = {"time_to_goal_s": time_s, "duration_s": time_s}
    return record(**names, **of_wrapper, **ending)
