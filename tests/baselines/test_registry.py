"""Controllers by name: what is registered, and what ``module:factory`` leads to."""

import sys

import numpy as np
import pytest

from defmanip_gym.baselines.controller import ZeroController
from defmanip_gym.baselines.registry import (
    available_controllers,
    factory_at,
    identity_of,
    make_controller,
    registered_controllers,
    summary_of,
)
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ControllerError
from defmanip_gym.evaluation.contestants import known_names, standard_contestants
from defmanip_gym.evaluation.protection import Certificates

MODULE = '''
from defmanip_gym.baselines.controller import ZeroController

def make_controller(config):
    """Does nothing,
    and does it well.

    More on that.
    """
    return ZeroController()

def make_none(config):
    return None
'''


@pytest.fixture
def strangers(tmp_path, monkeypatch):
    """Return a function that writes a module into the working directory and names it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])

    def write(text=MODULE, name="strangers_module"):
        (tmp_path / f"{name}.py").write_text(text)
        monkeypatch.delitem(sys.modules, name, raising=False)
        return f"{name}:make_controller"

    return write


def test_every_registered_controller_can_be_made():
    for reference in available_controllers().values():
        assert make_controller(reference, TransportConfig()).predict


def test_one_whose_package_is_missing_is_not_available(monkeypatch):
    monkeypatch.setitem(sys.modules, "daqp", None)  # as if it were not installed
    assert "lqr" in available_controllers() and "mpc" in registered_controllers()
    assert "mpc" not in available_controllers()


def test_a_strangers_controller_is_made_from_the_working_directory(strangers):
    reference = strangers()
    action, _ = make_controller(reference, TransportConfig()).predict(np.zeros((2, 21)))
    assert action.shape == (2, 3)
    assert summary_of(reference) == "Does nothing, and does it well"


def test_another_source_is_another_controller(strangers):
    reference = strangers()
    controller = make_controller(reference, TransportConfig())
    before = identity_of(reference, controller)
    strangers(MODULE + "# changed\n")
    assert identity_of(reference, controller) != before


@pytest.mark.parametrize(
    "reference, told",
    [
        ("no_such_module:make", "no_such_module"),
        ("strangers_module:nothing", "no function 'nothing'"),
        ("strangers_module:make_none", "predict"),
        ("strangers_module.below:make", "strangers_module"),
        (":make", "module:factory"),
        ("strangers_module:", "module:factory"),
        ("a b:c", "module:factory"),
    ],
)
def test_a_reference_that_leads_nowhere_says_why(strangers, reference, told):
    strangers()
    with pytest.raises(ControllerError, match=told):
        make_controller(reference, TransportConfig())


def test_what_a_module_itself_lacks_is_its_own_error(strangers):
    reference = strangers("import something_that_nobody_has\n")
    with pytest.raises(ModuleNotFoundError, match="something_that_nobody_has"):
        factory_at(reference)


def test_an_identity_that_json_cannot_hold_is_refused():
    class Unclear(ZeroController):
        identity = {"gains": np.zeros(3)}

    with pytest.raises(ControllerError, match="write arrays as lists"):
        identity_of("somebody:make", Unclear())


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Install a package that registers a controller that cannot be made."""

    def install(name):
        described = tmp_path / "somebody-1.0.dist-info"
        described.mkdir()
        (described / "METADATA").write_text("Metadata-Version: 2.1\nName: somebody\nVersion: 1.0\n")
        registered = f"[defmanip_gym.controllers]\n{name} = nowhere:make\n"
        (described / "entry_points.txt").write_text(registered)
        monkeypatch.syspath_prepend(tmp_path)

    return install


def test_two_controllers_of_one_name_are_refused(installed):
    installed("lqr")
    with pytest.raises(ControllerError, match="nowhere:make"):
        registered_controllers()


def test_what_somebodys_package_cannot_make_is_no_obstacle_to_others(installed):
    installed("theirs")
    (zero,) = standard_contestants(["zero"], Certificates())
    assert zero.name == "zero" and "theirs" in known_names()
