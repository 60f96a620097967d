"""``defmanip plan``: optima and plans start by start, written as they are found."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console

from defmanip_gym.errors import RecordError
from defmanip_gym.files import require_writable, write_atomically
from defmanip_gym.oracle.config import PlanConfig
from defmanip_gym.oracle.page import optimum_page
from defmanip_gym.planning.limits import NO_MARGINS
from defmanip_gym.planning.plan import Plan
from defmanip_gym.planning.plan_file import read_plans, write_plans
from defmanip_gym.planning.problem import require_casadi
from defmanip_gym.planning.search import coarse_optima, refined
from defmanip_gym.planning.setting import PlanningSetting, as_json
from defmanip_gym.planning.stored import StoredPlan, StoredPlans
from defmanip_gym.version import __version__


def run_plan(config: PlanConfig) -> StoredPlans:
    """Plan for every start and return what the file then holds.

    Raises:
        InstallationError: CasADi is not installed.
        ParameterError: a start without plan, or an unknown suite.
        RecordError: the file exists and is no file of plans, or file or page cannot be written.
    """
    setting, console, starts = PlanningSetting(), Console(), config.starts
    places = {"output": config.output, "page": config.page}
    for option, path in places.items():
        if path is not None:
            with _writing(option, path):
                require_writable(path)
    plans = _begun(config, setting)
    for number, start in enumerate(starts, start=1):
        if plans.find(start) is not None:
            continue
        begun = time.perf_counter()
        found = planned(setting, start, config)
        plans = plans.including(found)
        with _writing("output", config.output):
            write_plans(config.output, plans)
        console.print(
            f"{number}/{len(starts)}: T* {found.optimum_s:.3f} s ({found.optimal_guess}), "
            f"to be driven in {found.drive.duration_s:.3f} s; "
            f"{time.perf_counter() - begun:.1f} s of computing",
            highlight=False,
        )
    if config.page is not None:
        page = optimum_page(plans, config.chosen)
        with _writing("page", config.page):
            write_atomically(config.page, page.encode())
    return plans


def planned(setting: PlanningSetting, start: tuple[float, ...], config: PlanConfig) -> StoredPlan:
    """Return optimum and driving plan of a start."""
    model, state, search = setting.model, setting.state_at(start), config.search
    limits = setting.limits(NO_MARGINS)
    optima = coarse_optima(model, limits, state, search)
    optimum = refined(model, limits, state, optima, search)
    # with margins another of the local optima may be the quickest
    candidates: list[Plan] = [optimum, *optima[1:]]
    drive = refined(model, setting.limits(config.margins), state, candidates, search)
    return StoredPlan(
        start=start,
        optimum_s=optimum.duration_s,
        optimal_guess=optimum.guess,
        drive=drive,
    )


def made_with(config: PlanConfig, setting: PlanningSetting) -> dict[str, Any]:
    """Return all that plans depend on, as JSON values."""
    return setting.identity | {
        "driving_limits": as_json(setting.limits(config.margins)),
        "search": as_json(config.search),
        "casadi": str(require_casadi().__version__),
        "package": __version__,
    }


@contextmanager
def _writing(option: str, path: Path) -> Iterator[None]:
    """Raise RecordError for what cannot be written."""
    try:
        yield
    except OSError as error:
        raise RecordError(option, str(path), "a file that can be written", f"{error}.") from error


def _begun(config: PlanConfig, setting: PlanningSetting) -> StoredPlans:
    """Return what there is already, if it was made with the same settings."""
    new = StoredPlans(made_with=made_with(config, setting))
    if config.fresh or not config.output.exists():
        return new
    old = read_plans(config.output)
    return old if old.made_with == new.made_with else new
