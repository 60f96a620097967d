"""The main job: all contestants on the same scenarios, resumable, ending in table and report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from itertools import chain
from pathlib import Path

from filelock import FileLock, Timeout
from rich.console import Console

from defmanip_gym.baselines.controller import Controller
from defmanip_gym.baselines.learned.agents import load_agent, shipped_families
from defmanip_gym.display import progress_bar
from defmanip_gym.errors import RecordError
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.contestants import (
    SHIPPED_AGENT,
    Contestant,
    agent_contestants,
    default_contestants,
)
from defmanip_gym.evaluation.outputs import TRACE_FOLDER, print_results, write_outputs
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.rollout import rollout
from defmanip_gym.evaluation.scenarios import Scenario, comparison_scenarios
from defmanip_gym.evaluation.store import RecordStore, fingerprint
from defmanip_gym.evaluation.traces import Trace
from defmanip_gym.validation import require_choice
from defmanip_gym.version import __version__

__all__ = ["ComparisonConfig", "run_comparison"]

RECORD_FILE = "records.jsonl"
_TRACED_SCENARIOS = 4  # the paper's and three sampled ones


def run_comparison(config: ComparisonConfig) -> Path:
    """Run what is missing, write all outputs, print the table, return the report's path.

    Ctrl-C keeps the finished episodes and exits with 130 after saying how to go on.

    Raises:
        RecordError: the output folder cannot be used or holds another comparison.
        ParameterError: unknown contestants or settings out of range.
        CertificateError: σ or the damping leaves no room for the certificates.
        AgentFileError: the shipped agent takes part but cannot be loaded.
    """
    console = Console()
    beam, sigma_rad = config.environment.beam, config.sigma_rad
    everyone = default_contestants(beam, sigma_rad)
    guests = [agent_contestants(path, beam, sigma_rad) for path in config.agents]
    by_name = {c.name: c for c in (*_selected(everyone, config), *chain.from_iterable(guests))}
    contestants = tuple(by_name.values())  # an agent named twice takes part once
    scenarios = comparison_scenarios(config.episodes)
    try:
        with _exclusive(config.output):
            store = _open_store(config, _fingerprint(config, everyone, scenarios))
            _run_missing(config, contestants, scenarios, store, console)
            summaries, report = write_outputs(config, contestants, store.records)
    except KeyboardInterrupt:
        console.print(
            f"Stopped; finished episodes are kept in {config.output}. "
            "Go on by running the same command again (without --fresh)."
        )
        raise SystemExit(130) from None
    print_results(console, summaries, report)
    return report


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


def _selected(everyone: Sequence[Contestant], config: ComparisonConfig) -> tuple[Contestant, ...]:
    names = [contestant.name for contestant in everyone]
    for name in config.contestants or ():
        require_choice("contestants", name, names)
    wanted = config.contestants or names
    return tuple(contestant for contestant in everyone if contestant.name in wanted)


def _fingerprint(
    config: ComparisonConfig, everyone: Sequence[Contestant], scenarios: Sequence[Scenario]
) -> str:
    """Identify whatever the records depend on; not who takes part, so that more can join."""
    agent = SHIPPED_AGENT in shipped_families()
    return fingerprint(
        {
            "package_version": __version__,
            "environment": asdict(config.environment),
            "horizon_s": config.horizon_s,
            "scenarios": [asdict(scenario) for scenario in scenarios],
            "certificates": {
                contestant.name: asdict(contestant.certificate)
                for contestant in everyone
                if contestant.certificate is not None
            },
            "agent": load_agent(SHIPPED_AGENT).digest if agent else None,
        }
    )


def _open_store(config: ComparisonConfig, identity: str) -> RecordStore:
    path, traces = config.output / RECORD_FILE, config.output / TRACE_FOLDER
    try:
        traces.mkdir(parents=True, exist_ok=True)
        if config.fresh:
            path.unlink(missing_ok=True)
            for trace in traces.glob("*.npz"):
                trace.unlink()
        return RecordStore(path, identity)
    except OSError as error:
        raise RecordError(
            "output", str(config.output), "a folder that can be written", f"{error}."
        ) from error


def _run_missing(
    config: ComparisonConfig,
    contestants: Sequence[Contestant],
    scenarios: Sequence[Scenario],
    store: RecordStore,
    console: Console,
) -> None:
    """Run the episodes that have no record yet, contestant by contestant."""
    jobs: list[tuple[Contestant, Controller, list[Scenario]]] = []
    for contestant in contestants:
        finished = store.finished(contestant.name)
        missing = [scenario for scenario in scenarios if scenario.name not in finished]
        if missing:  # built before anything runs: a missing agent shows at once
            controller = contestant.build([scenario.seed for scenario in missing])
            jobs.append((contestant, controller, missing))
    steps = config.step_count
    traced = [scenario.name for scenario in scenarios[:_TRACED_SCENARIOS]]

    def keep(record: EpisodeRecord, trace: Trace | None) -> None:
        if trace is not None:  # before the record: a record says that all is there
            trace.save(config.output / TRACE_FOLDER)
        store.add(record)

    with progress_bar(console) as progress:
        task = progress.add_task("", total=len(jobs) * steps or 1)
        for index, (contestant, controller, missing) in enumerate(jobs):
            progress.update(task, description=contestant.name, completed=index * steps)
            rollout(
                contestant.name,
                controller,
                missing,
                config=config.environment,
                horizon_s=config.horizon_s,
                certificate=contestant.certificate,
                traced=traced,
                on_finished=keep,
                on_step=lambda: progress.advance(task),
            )
        progress.update(task, description="all contestants", completed=len(jobs) * steps or 1)
