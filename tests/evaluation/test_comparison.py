"""Comparisons: resumed, parallel, interrupted, and refused where something is wrong."""

from __future__ import annotations

from dataclasses import replace

import joblib
import pytest
from filelock import FileLock

from defmanip_gym.errors import ParameterError, RecordError
from defmanip_gym.evaluation import comparison, jobs, suites
from defmanip_gym.evaluation.comparison import ComparisonConfig, run_comparison
from defmanip_gym.evaluation.timings import read_timings
from defmanip_gym.evaluation.traces import load_trace


def config(folder, **changes):
    settings = {
        "output": folder / "out",
        "suites": ("nominal", "mismatch"),
        "episodes": 1,
        "contestants": ("zero", "tanner"),
        "jobs": 1,
    }
    return ComparisonConfig(**(settings | changes))


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Episodes of a fifth of a second and two conditions a suite; outputs have their own tests."""
    brief = tuple(
        replace(
            suite,
            horizon_s=0.2,
            scenarios=tuple(s for c in suite.conditions[:2] for s in suite.of(c)[:4]),
        )
        for suite in suites.SUITES
    )
    monkeypatch.setattr(suites, "SUITES", brief)
    monkeypatch.setattr(comparison, "print_results", lambda *_: None)
    monkeypatch.setattr(
        comparison,
        "write_outputs",
        lambda config, contestants, records: (records, config.output / "report.html"),
    )


@pytest.fixture
def recorded(monkeypatch):
    """The records that the outputs were made of."""
    records = []

    def write(config, contestants, found):
        records[:] = found
        return (), config.output / "report.html"

    monkeypatch.setattr(comparison, "write_outputs", write)
    return records


@pytest.fixture
def started(monkeypatch):
    """Suite, contestant and scenario of every episode that was started."""
    names = []

    def counting(job):
        entry = job.entry
        names.extend((entry.suite, entry.contestant, s.name) for s in job.suite.scenarios)
        return jobs.run_job(job)

    monkeypatch.setattr(comparison, "run_job", counting)
    return names


def files(folder):
    paths = (path for path in (folder / "records").rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def test_a_finished_comparison_is_not_run_again(tmp_path, started, recorded):
    run_comparison(config(tmp_path))
    assert len(started) == 2 * (1 + 2)
    first = list(recorded)
    started.clear()
    run_comparison(config(tmp_path))
    assert started == [] and recorded == first


def test_records_are_in_order_and_paired(tmp_path, recorded):
    run_comparison(config(tmp_path))
    assert [(r.suite, r.contestant, r.scenario) for r in recorded] == [
        (suite, contestant, scenario)
        for suite, scenarios in (
            ("nominal", ["nominal-00"]),
            ("mismatch", ["damping-x0.1-00", "damping-x0.3-00"]),
        )
        for contestant in ("zero", "tanner")
        for scenario in scenarios
    ]


def test_an_interrupted_comparison_goes_on_without_repeating(
    tmp_path, started, monkeypatch, capsys
):
    def interrupted(job):
        if job.entry.suite == "mismatch":
            raise KeyboardInterrupt
        return jobs.run_job(job)

    with monkeypatch.context() as patch:
        patch.setattr(comparison, "run_job", interrupted)
        with pytest.raises(SystemExit) as stop:
            run_comparison(config(tmp_path))
    assert stop.value.code == 130
    assert "running the same command again" in " ".join(capsys.readouterr().out.split())
    started.clear()
    run_comparison(config(tmp_path))
    assert {suite for suite, *_ in started} == {"mismatch"}
    run_comparison(config(tmp_path, output=tmp_path / "reference"))
    assert files(tmp_path / "out") == files(tmp_path / "reference")


def test_contestants_suites_and_episodes_can_join_later(tmp_path, started, recorded):
    run_comparison(config(tmp_path, contestants=("zero",), suites=("nominal",)))
    run_comparison(config(tmp_path, suites=("nominal",)))
    started.clear()
    run_comparison(config(tmp_path, episodes=3))
    assert ("nominal", "zero", "nominal-00") not in started
    assert {("nominal", "zero", "nominal-02"), ("mismatch", "tanner", "damping-x0.3-02")} < set(
        started
    )
    more = len(recorded)
    started.clear()
    run_comparison(config(tmp_path))
    assert started == [] and len(recorded) == 6 < more
    run_comparison(config(tmp_path, output=tmp_path / "at once", episodes=3))
    assert files(tmp_path / "out") == files(tmp_path / "at once")


def test_fresh_discards_results_and_nothing_else(tmp_path, started):
    run_comparison(config(tmp_path))
    mine = tmp_path / "out" / "records" / "notes.txt"
    mine.write_text("mine")
    started.clear()
    run_comparison(config(tmp_path, fresh=True))
    assert len(started) == 6 and mine.read_text() == "mine"


@pytest.mark.parametrize(
    "damage", [lambda b: b[: len(b) // 2], lambda b: b.replace(b"-00", b"-01")]
)
def test_a_damaged_file_is_named_and_the_other_work_kept(tmp_path, started, damage):
    run_comparison(config(tmp_path))
    path = tmp_path / "out" / "records" / "nominal" / "tanner.-.jsonl"
    path.write_bytes(damage(path.read_bytes()))
    before = files(tmp_path / "out")
    started.clear()
    with pytest.raises(RecordError, match=r"tanner\.-\.jsonl.*Delete this file"):
        run_comparison(config(tmp_path))
    assert started == [] and files(tmp_path / "out") == before
    path.unlink()
    run_comparison(config(tmp_path))
    assert started == [("nominal", "tanner", "nominal-00")]


def test_records_of_another_plant_need_another_folder_or_fresh(tmp_path, monkeypatch):
    run_comparison(config(tmp_path))
    longer = tuple(replace(suite, horizon_s=0.3) for suite in suites.SUITES)
    monkeypatch.setattr(suites, "SUITES", longer)
    with pytest.raises(RecordError, match="--fresh"):
        run_comparison(config(tmp_path))
    run_comparison(config(tmp_path, fresh=True))


def test_every_contestants_decisions_are_timed_once(tmp_path):
    run_comparison(config(tmp_path, contestants=("zero", "tanner/l1")))
    path = tmp_path / "out" / "timings.json"
    first = read_timings(path)
    assert set(first) == {"zero", "tanner/l1"} and min(first.values()) > 0
    run_comparison(config(tmp_path))
    assert read_timings(path)["zero"] == first["zero"] and "tanner" in read_timings(path)
    path.write_text("nonsense")
    run_comparison(config(tmp_path))
    assert set(read_timings(path)) == {"zero", "tanner"}


def test_one_scenario_of_each_condition_is_traced(tmp_path):
    run_comparison(config(tmp_path, episodes=1, suites=("mismatch",), contestants=("tanner",)))
    paths = (tmp_path / "out" / "traces").rglob("*.npz")
    told = {path.name.split(".", 2)[2].removesuffix("-00.npz") for path in paths}
    assert told == {condition.name for condition in suites.suite_named("mismatch").conditions}


def test_two_scenarios_of_a_suite_with_one_condition_are_traced(tmp_path):
    run_comparison(config(tmp_path, episodes=3, suites=("nominal",), contestants=("tanner",)))
    paths = sorted((tmp_path / "out" / "traces").rglob("*.npz"))
    names = ["tanner.-.nominal-00.npz", "tanner.-.nominal-01.npz"]
    assert [path.name for path in paths] == names
    assert load_trace(paths[0]).time_s[-1] == pytest.approx(0.2)


def test_bad_settings_are_refused(tmp_path):
    with pytest.raises(ParameterError, match="'tanner/l1'"):
        run_comparison(config(tmp_path, contestants=("tanner/l2",)))
    with pytest.raises(ParameterError, match="'mismatch'.*'all'"):
        config(tmp_path, suites=("mismach",))
    for name in ("episodes", "members", "jobs"):
        with pytest.raises(ParameterError, match=name):
            config(tmp_path, **{name: 0})
    assert not (tmp_path / "out").exists()


def test_an_output_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "out").write_text("mine")
    with pytest.raises(RecordError, match="a folder that can be written"):
        run_comparison(config(tmp_path))


def test_a_second_comparison_in_the_same_folder_is_refused(tmp_path):
    settings = config(tmp_path)
    settings.output.mkdir(parents=True, exist_ok=True)
    with FileLock(settings.output / ".lock"), pytest.raises(RecordError, match="no other"):
        run_comparison(settings)


def test_command_repeats_the_settings():
    settings = ComparisonConfig(suites=("all",), contestants=("zero", "ppo"), fresh=True, jobs=3)
    assert settings.command == "python evaluate.py --suites all --contestants zero ppo"


def test_all_means_everything():
    settings = ComparisonConfig(suites=("all",), episodes="all", members="all")
    assert settings.chosen_suites == suites.SUITES and settings.member_limit is None


def test_a_backend_of_the_users_takes_the_jobs_over_with_the_same_records(tmp_path):
    distributed = pytest.importorskip("distributed")
    here = config(tmp_path)
    run_comparison(here)
    there = config(tmp_path, output=tmp_path / "cluster", jobs=None)
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
        joblib.parallel_config(backend="dask"),
    ):
        run_comparison(there)
        done = client.run_on_scheduler(lambda dask_scheduler: len(dask_scheduler.task_prefixes))
    assert done > 0
    assert files(here.output) == files(there.output)
