"""Controllers of installed packages in comparisons: left out or refused, and never mistaken."""

from __future__ import annotations

import sys

import pytest
from strangers import install

from defmanip_gym.errors import ControllerError
from defmanip_gym.evaluation import comparison
from defmanip_gym.evaluation.config import ComparisonConfig

MODULE = """
from defmanip_gym.baselines.controller import ZeroController

def good(config):
    return ZeroController()

def fails(config):
    raise KeyError("gains")

class Stumbles:
    def __init__(self, config):
        pass

    def predict(self, observation):
        return observation
"""
STRANGERS = {
    "sac": "strangers_module:good",
    "good": "strangers_module:good",
    "fails": "strangers_module:fails",
    "nowhere": "nowhere:make",
    "a/b": "strangers_module:good",
}


@pytest.fixture
def strangers(tmp_path, monkeypatch):
    """Install a package whose controllers are fit, broken and misnamed."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "strangers_module", raising=False)
    (tmp_path / "strangers_module.py").write_text(MODULE)
    install(tmp_path, **STRANGERS)


def run(folder, names):
    config = ComparisonConfig(
        output=folder / "results", suites=("paper",), episodes=1, contestants=names, jobs=1
    )
    comparison.run_comparison(config)


@pytest.fixture
def wanted(monkeypatch):
    """Return the names of who would have run."""
    kept = []
    monkeypatch.setattr(
        comparison, "standard_contestants", lambda names, *_: kept.extend(names) or ()
    )
    monkeypatch.setattr(comparison, "write_outputs", lambda config, *_: ((), config.output))
    return kept


def test_the_standard_comparison_goes_on_without_them_and_says_so_once(
    strangers, wanted, tmp_path, capsys
):
    run(tmp_path, None)
    assert {"good", "good/storage", "sac", "sac/storage", "lqr"} < set(wanted)
    assert not {"fails", "nowhere", "a/b"} & set(wanted)
    said = [line for line in capsys.readouterr().out.splitlines() if line.startswith("Left out")]
    for name, why in (
        ("sac", "family of shipped agents"),
        ("fails", "KeyError: 'gains'"),
        ("nowhere", "There is no 'nowhere'"),
        ("a/b", "letters"),
    ):
        (line,) = (each for each in said if each.startswith(f"Left out: controller {name!r}"))
        assert why in line


@pytest.mark.parametrize("name", ["sac", "sac/storage", "sac@measured_force", "a/b", "a/b/storage"])
def test_a_name_that_a_package_may_not_give_is_refused_where_it_is_asked_for(
    strangers, wanted, tmp_path, name
):
    with pytest.raises(ControllerError, match="somebody.*strangers_module:good"):
        run(tmp_path, ("zero", name))
    assert not wanted


@pytest.mark.parametrize("name, cause", [("fails", KeyError), ("nowhere", ModuleNotFoundError)])
def test_one_that_cannot_be_made_is_an_error_where_it_is_asked_for(
    strangers, tmp_path, name, cause
):
    with pytest.raises(
        ControllerError, match=f"controller '{name}': .*{STRANGERS[name]}"
    ) as caught:
        run(tmp_path, (name,))
    assert type(caught.value.__cause__) is cause


def test_what_a_controller_raises_while_it_runs_is_told_with_its_name(strangers, tmp_path):
    name = "strangers_module:Stumbles"
    with pytest.raises(ControllerError, match=f"{name}.*TypeError") as caught:
        run(tmp_path, (name,))
    assert isinstance(caught.value.__cause__, TypeError)
