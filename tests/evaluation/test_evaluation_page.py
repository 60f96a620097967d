"""docs/evaluation.md says what the code does."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import joblib.parallel
import pytest

from defmanip_gym.evaluation import comparison, seeds
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.contestants import standard_names
from defmanip_gym.evaluation.options import FILTER_OPTION
from defmanip_gym.evaluation.protection import StorageProtection
from defmanip_gym.evaluation.records import EpisodeRecord
from defmanip_gym.evaluation.statistics.aggregates import WORST_SHARE
from defmanip_gym.evaluation.statistics.resampling import RESAMPLES
from defmanip_gym.evaluation.store import _HEADER_FIELDS
from defmanip_gym.evaluation.suites import HORIZON_S, SUITES
from defmanip_gym.task_params import TaskParams
from defmanip_gym.wrappers.applicability import Applicability

PAGE = (Path(__file__).parents[2] / "docs" / "evaluation.md").read_text()


def row(suite, condition):
    """Return a condition's line of the page's table; what is as nominal is left empty."""
    own = condition.disturbance
    force = [f"{own.force_bias_n:g}"] if own.force_bias_n else []
    if own.force_amplitude_n:
        force.append(f"{own.force_amplitude_n:g} sin {own.force_frequency_rad_s:g}t")
    noises = ((own.force_sensor_noise_n, "N"), (own.swing_sensor_noise_rad, "rad"))
    factors = (condition.damping_factor, condition.mass_factor, condition.length_factor)
    judge = Applicability(
        condition.environment,
        StorageProtection(FILTER_OPTION).filter_for(condition),
        delay_periods=condition.delay_periods,
    )
    covered = not judge.configuration_reason
    cells = (
        suite.name,
        f"`{condition.name}`",
        str(len(suite.of(condition))),
        *(f"×{factor:g}" if factor != 1 else "" for factor in factors),
        " + ".join(force),
        ", ".join(f"{size:g} {unit}" for size, unit in noises if size),
        f"{1000 * condition.actuation_delay_s:g}" if condition.actuation_delay_s else "",
        "yes" if covered else "no",
    )
    return "| " + " | ".join(cells) + " |"


def test_the_table_of_conditions_is_the_suites():
    told = re.findall(r"^\| \w+ \| `.*", PAGE, re.M)
    expected = [row(suite, condition) for suite in SUITES for condition in suite.conditions]
    assert told == [re.sub(r" +", " ", line) for line in expected]


def test_numbers_are_those_of_the_code():
    text = " ".join(PAGE.split())
    for number in (
        f"{HORIZON_S:g} simulated seconds",
        f"worst {100 * WORST_SHARE:g} %",
        f"{RESAMPLES:,} resamples",
        f"limit of {TaskParams().max_speed_m_s:g} m/s",
        f"below {seeds.VALIDATION_SEED:,}",
        f"suites from {seeds.FIRST_EVALUATION_SEED:,}",
    ):
        assert number in text


def test_every_field_of_records_and_headers_is_explained():
    for name in {field.name for field in fields(EpisodeRecord)} | _HEADER_FIELDS:
        assert f"`{name}`" in PAGE, name


def test_every_option_is_mentioned_and_every_contestant_listed():
    for field in fields(ComparisonConfig):
        assert f"--{field.name.replace('_', '-')}" in PAGE
    analytic = [name for name in standard_names() if name.partition("/")[0] in ("zero", "tanner")]
    for name in (*analytic, "random"):
        assert f"`{name}`" in PAGE


def test_the_script_for_a_cluster_runs_there(monkeypatch):
    distributed = pytest.importorskip("distributed")
    used = []
    monkeypatch.setattr(
        comparison,
        "run_comparison",
        lambda config: used.append(type(joblib.parallel.get_active_backend()[0]).__name__),
    )
    *_, script = re.findall(r"```python\n(.*?)```", PAGE, re.S)
    with distributed.LocalCluster(n_workers=1, processes=False, dashboard_address=None) as cluster:
        script = script.replace('"tcp://scheduler:8786"', repr(cluster.scheduler_address))
        exec(compile(script, "evaluation.md", "exec"), {})
    assert used == ["DaskDistributedBackend"]
