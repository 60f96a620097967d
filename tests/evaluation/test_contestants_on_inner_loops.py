"""Contestants say which inner loop they run on; it counts for filter, records and report."""

import pytest

from defmanip_gym.baselines.analytic import field
from defmanip_gym.baselines.registry import inner_loop_of
from defmanip_gym.errors import ControllerError
from defmanip_gym.evaluation.assignments import assignments
from defmanip_gym.evaluation.config import ComparisonConfig
from defmanip_gym.evaluation.contestants import known_names, standard_contestants
from defmanip_gym.evaluation.controllers import Zero
from defmanip_gym.evaluation.jobs import job_fingerprint, run_job
from defmanip_gym.evaluation.protection import Certificates, StorageProtection
from defmanip_gym.evaluation.store import RecordFolder
from defmanip_gym.evaluation.suites import suite_named

FIELD = "defmanip_gym.baselines.analytic.field:make_controller"


def named(*names):
    return standard_contestants(names, Certificates(), member_limit=1)


def test_a_controller_says_which_one_it_is_made_for():
    (alone,), (inside,), (paper,) = named(FIELD), named(f"{FIELD}/storage"), named("tanner")
    assert alone.inner_loop == inside.inner_loop == "measured_force"
    assert inside.protection.inner_loop == "measured_force"
    assert "feels the grasp force" in alone.privileged
    assert paper.inner_loop == "model" and "feels" not in paper.privileged


def test_shipped_agents_can_be_asked_for_on_the_other_one():
    assert {"sac@measured_force", "sac@measured_force/storage"} < set(known_names())
    own, other = named("sac", "sac@measured_force/storage")
    assert (own.inner_loop, other.inner_loop) == ("model", "measured_force")
    assert other.protection == StorageProtection("storage", "measured_force")
    assert other.name_alone == "sac@measured_force"
    assert "measured_force" in other.description


def test_unknown_ones_are_refused():
    class Odd:
        inner_loop = "magic"

    with pytest.raises(ControllerError, match="magic"):
        inner_loop_of("some:factory", Odd())
    assert inner_loop_of("some:factory", object()) == "model"
    assert inner_loop_of(FIELD, field.FieldController()) == "measured_force"


def test_records_on_one_are_none_on_the_other():
    suite = suite_named("nominal")
    prints = {
        job_fingerprint(suite, Zero(), protection, kind)
        for kind in ("model", "measured_force")
        for protection in (None, StorageProtection("storage", kind))
    }
    assert len(prints) == 4


def test_half_and_twice_the_mass_arrive_inside_a_filter_that_covers_them(tmp_path):
    config = ComparisonConfig(output=tmp_path, suites=("payload",), episodes=1)
    names = ("sac@measured_force", f"{FIELD}/storage")
    for assignment in assignments(config, named(*names), RecordFolder(tmp_path / "records")):
        for episode in run_job(assignment.job).episodes:
            assert episode.record.success, episode.record.scenario
            assert episode.record.certificate_applies in (None, True)
