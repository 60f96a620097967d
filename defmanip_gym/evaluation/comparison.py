"""The main job: all contestants on the same scenarios, resumable, ending in table and report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path

from filelock import FileLock, Timeout
from rich.console import Console

from defmanip_gym.baselines.registry import surveyed_controllers
from defmanip_gym.display import progress_bar
from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.assignments import assignments
from defmanip_gym.evaluation.broken_certificates import broken_certificates
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.contestant import Contestant
from defmanip_gym.evaluation.contestants import (
    require_undisputed,
    standard_contestants,
    standard_names_with,
)
from defmanip_gym.evaluation.filter_timings import FILTER_TIMING_FILE, measured_filter_times
from defmanip_gym.evaluation.jobs import run_job
from defmanip_gym.evaluation.learned_contestants import agent_contestants
from defmanip_gym.evaluation.outputs import print_results, write_outputs
from defmanip_gym.evaluation.protection import Certificates
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.store import RecordFolder, remove_leftovers
from defmanip_gym.evaluation.suites import suite_named
from defmanip_gym.evaluation.timings import TIMING_FILE, measured_timings
from defmanip_gym.evaluation.traces import TRACE_FOLDER
from defmanip_gym.workers import running

__all__ = ["ComparisonConfig", "run_comparison"]

RECORD_FOLDER = "records"


def run_comparison(config: ComparisonConfig) -> Path:
    """Run what is missing, write all outputs, print the table, return the report's path.

    Jobs run in ``config.jobs`` processes. A cluster takes them over as a joblib backend, and needs
    no disk of this machine (but for SB3's zip files, which it loads itself), since results come
    back here before they are written:

        with joblib.parallel_config(backend="dask"): run_comparison(config)

    Ctrl-C keeps the finished jobs and exits with 130 after saying how to go on.

    Raises:
        RecordError: the output folder cannot be used, or holds damaged or other records.
        ParameterError: unknown contestants.
        ControllerError: a controller that was asked for cannot be made, or its name is disputed.
        AgentFileError: an agent cannot be loaded or does not fit the environment.
    """
    console = Console()
    contestants = _contestants(config, console)
    try:
        with _exclusive(config.output):
            records = _complete_records(config, contestants, console)
            measured_timings(config.output / TIMING_FILE, contestants)
            protections = [c.protection for c in contestants if c.protection is not None]
            measured_filter_times(config.output / FILTER_TIMING_FILE, protections)
            summaries, report = write_outputs(config, contestants, records)
    except KeyboardInterrupt:
        console.print(
            f"Stopped; finished jobs are kept in {config.output}. "
            "Go on by running the same command again (without --fresh)."
        )
        raise SystemExit(130) from None
    print_results(console, summaries, report)
    _print_broken(console, records)
    return report


def _contestants(config: ComparisonConfig, console: Console) -> tuple[Contestant, ...]:
    certificates = Certificates()
    if config.contestants is None:
        wanted = _everybody(console)
    else:
        wanted = config.contestants
        require_undisputed(wanted)
    chosen = standard_contestants(wanted, certificates, config.member_limit)
    guests = chain.from_iterable(
        agent_contestants(
            path,
            certificates,
            allow_pickle=config.allow_pickle,
            normalization=config.normalization,
        )
        for path in config.agents
    )
    by_name = {contestant.name: contestant for contestant in (*chosen, *guests)}
    return tuple(by_name.values())  # an agent named twice takes part once


def _everybody(console: Console) -> tuple[str, ...]:
    """Return the standard comparison's names, and say who cannot take part and why."""
    survey = surveyed_controllers()
    for error in survey.left_out:
        console.print(f"Left out: {error}", soft_wrap=True, highlight=False, markup=False)
    return standard_names_with(survey.available)


def _print_broken(console: Console, records: Sequence[EpisodeRecord]) -> None:
    """Say which episodes exceeded σ although a certificate promised that none would."""
    broken = broken_certificates(records)
    if broken:
        first = broken[0]
        console.print(
            f"{len(broken)} broken certificates: episodes that exceeded σ although the enforced "
            f"certificate covers them, the first one {first.contestant} (member {first.member}) in "
            f"{first.scenario} of {first.suite}.",
            style="bold red",
            highlight=False,
            markup=False,
        )


@contextmanager
def _exclusive(output: Path) -> Iterator[None]:
    """Keep a second comparison out of the folder while this one runs."""
    try:
        output.mkdir(parents=True, exist_ok=True)
        with FileLock(output / ".lock", timeout=0):
            yield
    except Timeout as error:
        raise RecordError(
            "output",
            str(output),
            "a folder that no other comparison writes to",
            "Wait or choose another.",
        ) from error
    except OSError as error:
        raise RecordError(
            "output", str(output), "a folder that can be written", f"{error}."
        ) from error


def _complete_records(
    config: ComparisonConfig, contestants: Sequence[Contestant], console: Console
) -> tuple[EpisodeRecord, ...]:
    """Return the records of all chosen episodes, running those that have none yet."""
    folder, traces = RecordFolder(config.output / RECORD_FOLDER), config.output / TRACE_FOLDER
    if config.fresh:
        _discard(config.output)
    remove_leftovers((folder.root, traces))
    # all that is there is read before anything runs: damage shows at once
    work = assignments(config, contestants, folder)
    by_entry = {assignment.job.entry: assignment for assignment in work}
    jobs = [assignment.job for assignment in work if assignment.job.suite.scenarios]
    console.print(_plan(config, contestants, len(work), len(jobs)), highlight=False)
    with progress_bar(console) as progress, running(run_job, jobs, config.jobs) as results:
        bar = progress.add_task("jobs", total=max(len(jobs), 1), completed=not jobs)
        for result in results:
            by_entry[result.job.entry].keep(result, folder, traces)
            progress.advance(bar)
    return tuple(record for assignment in work for record in assignment.records)


def _plan(
    config: ComparisonConfig, contestants: Sequence[Contestant], total: int, missing: int
) -> str:
    """Return what was chosen, in a sentence for each choice."""
    suites = ", ".join(
        f"{suite.name} ({len(suite.scenarios)} of {len(suite_named(suite.name).scenarios)})"
        for suite in config.chosen_suites
    )
    members = sum(len(contestant.members) for contestant in contestants)
    return (
        f"Suites: {suites} scenarios. Contestants: {len(contestants)} with {members} members. "
        f"Jobs: {total}, of which {total - missing} are done."
    )


def _discard(output: Path) -> None:
    """Delete what comparisons keep between runs, and nothing else."""
    kept = (f"{RECORD_FOLDER}/*/*.jsonl", f"{TRACE_FOLDER}/*/*.npz", TIMING_FILE)
    for pattern in (*kept, FILTER_TIMING_FILE):
        for path in output.glob(pattern):
            path.unlink()
