"""Controllers by name: who is registered, who may have a name, and who can be made."""

import sys

import numpy as np
import pytest
from strangers import install

from defmanip_gym.baselines.controller import ZeroController
from defmanip_gym.baselines.factories import make_controller
from defmanip_gym.baselines.registrations import registrations
from defmanip_gym.baselines.registry import (
    available_controllers,
    identity_of,
    registered_controllers,
    surveyed_controllers,
)
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ControllerError
from defmanip_gym.evaluation.contestants import known_names


def test_every_registered_controller_can_be_made():
    for reference in available_controllers().values():
        assert make_controller(reference, TransportConfig()).predict


def test_one_whose_package_is_missing_is_not_available(monkeypatch):
    monkeypatch.setitem(sys.modules, "daqp", None)  # as if it were not installed
    assert "lqr" in available_controllers() and "mpc" in registered_controllers()
    assert "mpc" not in available_controllers()


def test_an_identity_that_json_cannot_hold_is_refused():
    class Unclear(ZeroController):
        identity = {"gains": np.zeros(3)}

    with pytest.raises(ControllerError, match="write arrays as lists"):
        identity_of("somebody:make", Unclear())


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Return a function that installs a package with controllers, and return what is refused."""
    monkeypatch.syspath_prepend(tmp_path)

    def refused(package="somebody", **controllers):
        install(tmp_path, package, **controllers)
        return registrations().refused

    return refused


BASES = sorted({name.partition("/")[0].partition("@")[0] for name in known_names()})


@pytest.mark.parametrize("name", [*BASES, "storage", "backup", "cbf_qp", "l1", "phase_plane"])
def test_names_of_this_package_stay_its_own(installed, name):
    before = registered_controllers()
    error = installed(**{name: "nowhere:make"})[name]
    assert registered_controllers() == before
    for part in ("somebody", "nowhere:make", "defmanip_gym", repr(name), "Rename"):
        assert part in str(error)


@pytest.mark.parametrize("name", ["a/b", "a@b", "a:b", "a b", "a+b", "-a", ".."])
def test_names_that_would_mean_something_else_are_refused(installed, name):
    assert "letters" in installed(**{name: "nowhere:make"})[name].allowed
    assert name not in registered_controllers()


def test_two_packages_cannot_share_a_name(installed):
    installed(theirs="nowhere:make")
    error = installed("nobody", theirs="elsewhere:make", other="elsewhere:make")["theirs"]
    for part in ("somebody", "nobody", "nowhere:make", "elsewhere:make"):
        assert part in str(error)
    assert "theirs" not in registered_controllers() and "other" in registered_controllers()


def test_a_name_that_nobody_else_has_is_registered(installed):
    reference = "defmanip_gym.baselines.analytic.field:make_controller"
    assert not installed(**{"my-field_2.0": reference})
    assert available_controllers()["my-field_2.0"] == reference


def test_what_cannot_be_made_is_left_out_and_says_why(installed):
    installed(theirs="nowhere:make")
    survey = surveyed_controllers()
    assert "theirs" not in survey.available and "field" in survey.available
    (error,) = (each for each in survey.left_out if each.name.startswith("controller 'theirs'"))
    assert "There is no 'nowhere'" in str(error)
