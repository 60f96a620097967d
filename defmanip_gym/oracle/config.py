"""Settings of ``defmanip plan``; their docstrings are the command line's help."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from defmanip_gym.evaluation.suites import SUITE_NAMES, Suite, suite_named
from defmanip_gym.planning.limits import Margins
from defmanip_gym.planning.search import SearchParams


@dataclass(frozen=True, kw_only=True)
class PlanConfig:
    """Find the time-optimal motion from every start of the suites, and a plan to be driven.

    Starts that the file holds already, made with the same settings, are not planned again.

    Examples:
        defmanip plan --output plans.npz

        defmanip plan --suites nominal --output mine.npz --margins.swing 0.8
    """

    output: Path
    """File that is written, and gone on with where it exists."""
    suites: tuple[str, ...] = SUITE_NAMES
    """Whose starts are planned for."""
    margins: Margins = Margins()
    """Of the plans to be driven; the optimum has none."""
    search: SearchParams = SearchParams()
    """How thoroughly is searched."""
    fresh: bool = False
    """Plan everything anew."""
    page: Path | None = None
    """Markdown page of all optima, with what following the plans takes on the plant."""

    @property
    def chosen(self) -> tuple[Suite, ...]:
        """The suites.

        Raises:
            ParameterError: an unknown name.
        """
        return tuple(suite_named(name) for name in self.suites)

    @property
    def starts(self) -> tuple[tuple[float, ...], ...]:
        """Their starts, each once."""
        scenarios = (scenario for suite in self.chosen for scenario in suite.scenarios)
        return tuple(dict.fromkeys(scenario.start for scenario in scenarios))
