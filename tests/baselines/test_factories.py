"""What ``module:factory`` leads to, and what is said where it leads nowhere."""

import sys

import numpy as np
import pytest

from defmanip_gym.baselines.factories import make_controller, summary_of
from defmanip_gym.baselines.registry import identity_of, told_by
from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.errors import ControllerError, InstallationError

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

def make_class(config):
    return ZeroController

def make_nothing():
    return ZeroController()

def make_more(config, gain):
    return ZeroController()

def fails(config):
    raise KeyError("gains")

def ends(config):
    raise SystemExit(0)

def lacks(config):
    import something_that_nobody_has
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
        ("strangers_module:make_class", "Return a controller"),
        ("strangers_module:make_nothing", r"make_nothing\(\).*can be called with \(config\)"),
        ("strangers_module:make_more", "gain"),
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


@pytest.mark.parametrize(
    ("name", "cause"),
    [("fails", KeyError), ("ends", SystemExit), ("lacks", ModuleNotFoundError)],
)
def test_what_a_factory_raises_is_told_with_its_place(strangers, name, cause):
    strangers()
    with pytest.raises(ControllerError, match=rf"{cause.__name__}.*strangers_module.py") as caught:
        make_controller(f"strangers_module:{name}", TransportConfig())
    assert type(caught.value.__cause__) is cause


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("import something_that_nobody_has\n", ModuleNotFoundError),
        ("def make_controller(config)\n", SyntaxError),
        ("1 / 0\n", ZeroDivisionError),
        ("raise SystemExit(1)\n", SystemExit),
    ],
)
def test_a_module_that_cannot_be_imported_is_told_of_with_its_cause(strangers, text, cause):
    reference = strangers(text)
    with pytest.raises(ControllerError, match=f"{cause.__name__}.*strangers_module") as caught:
        make_controller(reference, TransportConfig())
    assert type(caught.value.__cause__) is cause


def test_errors_of_this_packages_own_factories_stay_what_they_are(monkeypatch):
    monkeypatch.setitem(sys.modules, "daqp", None)  # as if it were not installed
    with pytest.raises(InstallationError, match="qp"):
        make_controller("defmanip_gym.baselines.analytic.mpc:make_controller", TransportConfig())


@pytest.mark.parametrize(
    "said", ["identity = {1, 2}", "inner_loop = 'felt'", "inner_loop = []", "knows = 3"]
)
def test_what_a_controller_tells_of_itself_is_checked_when_it_is_made(strangers, said):
    told = f"class Unclear(ZeroController):\n    {said}\n"
    reference = strangers(MODULE.replace("def make_none", f"{told}\ndef make_none"))
    told_by(reference, TransportConfig())
    with pytest.raises(ControllerError, match=f"{said.partition(' ')[0]} of strangers_module"):
        told_by("strangers_module:Unclear", TransportConfig())


def test_an_attribute_that_fails_is_told_of(strangers):
    broken = "class Broken(ZeroController):\n    identity = property(lambda self: 1 / 0)\n"
    strangers(MODULE + broken)
    with pytest.raises(ControllerError, match="identity.*ZeroDivisionError"):
        told_by("strangers_module:Broken", TransportConfig())
