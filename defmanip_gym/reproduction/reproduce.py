"""The command ``defmanip reproduce``: parts that are missing, then figures, numbers and page."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from defmanip_gym.display import progress_bar, save_figure
from defmanip_gym.errors import RecordError
from defmanip_gym.reproduction.config import ReproductionConfig
from defmanip_gym.reproduction.figures import DPI, FIGURES
from defmanip_gym.reproduction.page import write_page
from defmanip_gym.reproduction.parts import Numbers, Part, fingerprint, finished_or_made
from defmanip_gym.reproduction.setting import paper_setting
from defmanip_gym.reproduction.studies import STUDIES, settings_of_studies
from defmanip_gym.reproduction.summary import summarize
from defmanip_gym.reproduction.transport import run_transport
from defmanip_gym.version import __version__

PART_FOLDER = "parts"
_TRANSPORT = "transport"


def run_reproduction(config: ReproductionConfig) -> Path:
    """Run what is missing, write all outputs, print the table, return the page's path.

    Ctrl-C keeps the finished parts and exits with 130 after saying how to go on.

    Raises:
        RecordError: the output folder cannot be used or holds another reproduction.
        DivergenceError: the plant diverged.
    """
    console = Console()
    try:
        parts = _parts(config, console)
        page = _write(config.output_dir, parts)
    except KeyboardInterrupt:
        console.print(
            f"Stopped; finished parts are kept in {config.output_dir / PART_FOLDER}. "
            "Go on by running the same command again (without --fresh)."
        )
        raise SystemExit(130) from None
    except OSError as error:
        raise RecordError(
            "output_dir", str(config.output_dir), "a folder that can be written", f"{error}."
        ) from error
    _tell(console, parts[_TRANSPORT].numbers, page)
    return page


def _parts(config: ReproductionConfig, console: Console) -> dict[str, Part]:
    """Return all parts, the short ones first: an interruption then costs least."""
    folder = config.output_dir / PART_FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    if config.fresh:
        for path in folder.glob("*.npz"):
            path.unlink()
    parts = {}
    with progress_bar(console) as progress:
        for name, study in STUDIES.items():
            task = progress.add_task(name.replace("_", " "), total=1)
            settings = [name, settings_of_studies(), config.max_duration_s, __version__]
            parts[name] = finished_or_made(
                folder / f"{name}.npz",
                fingerprint(settings),
                _timed(partial(study, config.max_duration_s)),
            )
            progress.update(task, completed=1)
        parts[_TRANSPORT] = _transport(config, folder, progress)
    return parts


def _transport(config: ReproductionConfig, folder: Path, progress: Progress) -> Part:
    setting = paper_setting(max_duration_s=config.max_duration_s)
    expected_s = min(config.max_duration_s, setting.expected_duration_s)
    task = progress.add_task("slow transport", total=expected_s)

    def make() -> Part:
        course = run_transport(setting, lambda time_s: progress.update(task, completed=time_s))
        return Part(numbers=summarize(setting, course), arrays=course.arrays)

    identity = fingerprint([_TRANSPORT, setting, __version__])
    part = finished_or_made(folder / f"{_TRANSPORT}.npz", identity, _timed(make))
    progress.update(task, completed=expected_s)
    return part


def _timed(make: Callable[[], Part]) -> Callable[[], Part]:
    """Return a maker that notes the processor time of what it makes."""

    def timed() -> Part:
        start = time.process_time()
        part = make()
        return replace(part, cpu_s=time.process_time() - start)

    return timed


def _write(folder: Path, parts: dict[str, Part]) -> Path:
    for figure in FIGURES:
        part = parts[figure.part]
        drawn = figure.draw(part.numbers, part.arrays)
        save_figure(folder / f"{figure.name}.png", drawn, dpi=DPI)
    numbers: Numbers = {name: part.numbers for name, part in parts.items()}
    numbers["cpu_s"] = {name: round(part.cpu_s, 1) for name, part in parts.items()}
    return write_page(folder, numbers)


def _tell(console: Console, numbers: Numbers, page: Path) -> None:
    """Print what matters most and where the rest is."""
    reached = "reached" if numbers["converged"] else "not reached"
    console.print(
        f"ν_max {numbers['nu_max']:.4e} m/s², goal {reached} after "
        f"{numbers['duration_s'] / 3600:.2f} simulated hours, "
        f"{1e3 * numbers['final_distance_m']:.1f} mm left, max |φ| "
        f"{numbers['largest_swing_rad']:.2e} of {numbers['sigma_rad']:.4f} rad",
        highlight=False,
    )
    console.print(f"Page: {page.resolve()}", soft_wrap=True, highlight=False)
