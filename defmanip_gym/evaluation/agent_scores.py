"""What an evaluation measured of the agents, written into their cards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from defmanip_gym.baselines.learned.actor import TENSOR_SUFFIX, MlpActor
from defmanip_gym.baselines.learned.card import AgentCard, SuiteScore
from defmanip_gym.baselines.learned.deployment import training_config
from defmanip_gym.baselines.learned.families import (
    SHIPPED,
    load_family,
    member_name,
    shipped_families,
    write_card,
)
from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.comparison import RECORD_FOLDER
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.controllers import Learned
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.jobs import job_fingerprint
from defmanip_gym.evaluation.protection import Certificates, protection_named
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.statistics import interquartile_mean
from defmanip_gym.evaluation.store import RecordFolder
from defmanip_gym.evaluation.suites import SUITES, suite_named

_SCORING_OUTPUT = Path("results/agents")


def contestant_name(family: str, card: AgentCard) -> str:
    """Return who a card's scores are of: the agent inside what it was trained inside, if any."""
    return family if card.trained_inside is None else f"{family}/{card.trained_inside}"


def suite_score(records: Sequence[EpisodeRecord]) -> SuiteScore:
    """Return the scores of one agent on one suite, from at least one record."""
    times = [record.time_to_goal_s for record in records if record.success]
    return SuiteScore(
        success_rate=float(np.mean([record.success for record in records])),
        violation_rate=float(np.mean([record.violated for record in records])),
        score_iqm=float(interquartile_mean(np.array([[record.score for record in records]]))),
        median_time_s=float(np.median(np.array(times, dtype=float))) if times else None,
        episodes=len(records),
    )


def write_scores(results: Path, library: Path = SHIPPED) -> tuple[str, ...]:
    """Write what an evaluation measured into the agents' cards, in place of earlier scores.

    Args:
        results: output folder of an evaluation.
        library: folder of families, the package's own by default.

    Returns:
        Names of the agents whose cards were written; others keep what they had.

    Raises:
        AgentFileError: an agent is damaged.
        RecordError: records are damaged or of other agents than these, or there are none.
    """
    certificates = Certificates()
    members = [
        (family, actor)
        for family in shipped_families(library)
        for actor in load_family(family, library)
    ]
    # everything is read before anything is written
    scores = [_scores(results, family, actor, certificates) for family, actor in members]
    if not any(scores):
        raise RecordError(
            "score",
            str(results),
            f"the output folder of an evaluation of agents in {library}",
            "Make one with evaluate.py.",
        )
    written = []
    for (family, actor), measured in zip(members, scores, strict=True):
        if measured:
            write_card(family, replace(actor.card, scores=measured), library)
            written.append(f"{family}/{member_name(actor.card.seed)}")
    return tuple(written)


def scoring_commands(name: str, card: AgentCard, library: Path = SHIPPED) -> tuple[str, ...]:
    """Return the shell commands that measure an agent's scores again and write them.

    Only shipped agents' are written; others are measured beside the paper's controller.

    Args:
        name: of a family or member such as ``"ppo/seed-0"``, or a path.
        card: the agent's.
        library: folder of families, the package's own by default.
    """
    suites, episodes = _measured_on(card)
    evaluation = ComparisonConfig(
        suites=suites, episodes=episodes, members="all", output=_SCORING_OUTPUT
    )
    family = name.partition("/")[0]
    if family not in shipped_families(library) or library != SHIPPED:
        path = Path(name)
        if family in shipped_families(library):
            path = library / family / f"{member_name(card.seed)}{TENSOR_SUFFIX}"
        return (replace(evaluation, contestants=("tanner",), agents=(path,)).command,)
    contestants = (contestant_name(family, card),)
    return (
        replace(evaluation, contestants=contestants).command,
        f"defmanip agents --score {_SCORING_OUTPUT}",
    )


def _scores(
    results: Path, family: str, actor: MlpActor, certificates: Certificates
) -> dict[str, SuiteScore]:
    """Return an agent's scores by suite, empty if it did not take part."""
    card, folder = actor.card, RecordFolder(results / RECORD_FOLDER)
    inner_loop = training_config(card).inner_loop
    protection = protection_named(card.trained_inside or "", certificates, inner_loop)
    is_residual = card.residual_authority_m_s2 is not None
    controller = Learned(actor, protection.certificate if is_residual and protection else None)
    scores = {}
    for suite in SUITES:
        entry = Entry(
            suite=suite.name,
            contestant=contestant_name(family, card),
            family="learned",
            member=str(card.seed),
        )
        records = folder.read(entry, job_fingerprint(suite, controller, protection, inner_loop))
        if records:
            scores[suite.name] = suite_score(records)
    return scores


def _measured_on(card: AgentCard) -> tuple[tuple[str, ...], int | Literal["all"]]:
    """Return suites and episodes per condition that a card's scores are of; all without any."""
    suites = [suite_named(name) for name in card.scores]
    episodes = [score.episodes for score in card.scores.values()]
    if [len(suite.scenarios) for suite in suites] == episodes:
        return tuple(suite.name for suite in suites) or ("all",), "all"
    counts = zip(episodes, (len(suite.conditions) for suite in suites), strict=True)
    return tuple(suite.name for suite in suites), max(-(-n // parts) for n, parts in counts)
