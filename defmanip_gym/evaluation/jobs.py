"""The unit of work of a comparison: one member of a contestant on one suite, in any process."""

from __future__ import annotations

from dataclasses import dataclass

from defmanip_gym.envs.config import InnerLoopKind
from defmanip_gym.evaluation.controllers import ControllerSpec
from defmanip_gym.evaluation.entry import Entry
from defmanip_gym.evaluation.protection import Protection
from defmanip_gym.evaluation.rollout import Episode, rollout
from defmanip_gym.evaluation.store import fingerprint
from defmanip_gym.evaluation.suites import Suite
from defmanip_gym.version import __version__


@dataclass(frozen=True, kw_only=True)
class Job:
    """Everything that its process needs; can be pickled.

    Attributes:
        entry: names the results.
        controller: how to make the controller.
        protection: around the environment, or None.
        inner_loop: of the environment.
        suite: with those scenarios that have no record yet.
        traced: names of the scenarios whose time course is wanted.
        num_threads: physics threads, 0 for one per CPU.
    """

    entry: Entry
    controller: ControllerSpec
    protection: Protection | None
    inner_loop: InnerLoopKind
    suite: Suite
    traced: tuple[str, ...]
    num_threads: int


@dataclass(frozen=True, kw_only=True)
class JobResult:
    """The episodes of a finished job, in the order of its scenarios."""

    job: Job
    episodes: tuple[Episode, ...]


def run_job(job: Job) -> JobResult:
    """Run a job's episodes, condition by condition, each of them as one batch."""
    episodes: list[Episode] = []
    protection = job.protection
    for condition in job.suite.conditions:
        scenarios = job.suite.of(condition)
        episodes += rollout(
            job.entry,
            job.controller.build([scenario.seed for scenario in scenarios]),
            scenarios,
            config=condition.environment_on(job.inner_loop),
            horizon_s=job.suite.horizon_s,
            safety_filter=None if protection is None else protection.filter_for(condition),
            delay_periods=condition.delay_periods,
            traced=job.traced,
            num_threads=job.num_threads,
        )
    return JobResult(job=job, episodes=tuple(episodes))


def job_fingerprint(
    suite: Suite,
    controller: ControllerSpec,
    protection: Protection | None,
    inner_loop: InnerLoopKind = "model",
) -> str:
    """Identify whatever the records of a job depend on.

    Args:
        suite: the whole of it, also where only the first scenarios are run.
        controller: of the job.
        protection: of the job.
        inner_loop: of the job.
    """
    return fingerprint(
        {
            "package_version": __version__,
            "horizon_s": suite.horizon_s,
            "environments": [
                condition.environment_on(inner_loop).identity for condition in suite.conditions
            ],
            "scenarios": suite.digest,
            "controller": controller.identity,
            "certificate": None if protection is None else protection.identity,
        }
    )
