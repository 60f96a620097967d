"""The command: outputs, resuming, interruption, wrong input; and the page in docs/."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from defmanip_gym import cli
from defmanip_gym.errors import ParameterError, RecordError
from defmanip_gym.reproduction import reproduce
from defmanip_gym.reproduction.config import ReproductionConfig
from defmanip_gym.reproduction.page import render_page
from defmanip_gym.reproduction.reproduce import run_reproduction
from defmanip_gym.reproduction.setting import paper_nu_max, paper_setting
from defmanip_gym.reproduction.studies import STUDIES
from defmanip_gym.reproduction.summary import summarize
from defmanip_gym.reproduction.transport import run_transport

DOCS = Path(__file__).parents[2] / "docs"
FIGURES = ("figure_2", "figure_3", "figure_4", "figure_5", "damping_study", "l1")


def short(folder, **changes):
    return ReproductionConfig(**{"output_dir": folder / "out", "max_duration_s": 1.0, **changes})


@pytest.fixture
def without_figures(monkeypatch):
    """Figures have their test, and take seconds."""
    monkeypatch.setattr(reproduce, "FIGURES", ())


@pytest.fixture
def made(monkeypatch):
    """Names of the parts that were computed."""
    names = []

    def noting(name, function):
        def noted(*arguments):
            names.append(name)
            return function(*arguments)

        return noted

    studies = {name: noting(name, study) for name, study in reproduce.STUDIES.items()}
    monkeypatch.setattr(reproduce, "STUDIES", studies)
    transport = noting("transport", reproduce.run_transport)
    monkeypatch.setattr(reproduce, "run_transport", transport)
    return names


def test_outputs_are_written_and_finished_parts_are_not_run_again(tmp_path, made, capsys):
    page = run_reproduction(short(tmp_path))
    assert made == ["damping_study", "l1", "physics_step", "transport"]
    assert "Page:" in capsys.readouterr().out
    for name in FIGURES:
        assert (page.parent / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert f"({name}.png)" in page.read_text()
    numbers = json.loads((page.parent / "numbers.json").read_text())
    assert numbers["transport"]["nu_max"] == pytest.approx(1.089e-3, rel=1e-3)
    assert numbers["transport"]["converged"] is False
    with np.load(page.parent / "parts" / "transport.npz", allow_pickle=False) as file:
        assert {"time_s", "last", "opening"} <= set(file.files)
    first = page.read_text()
    page.unlink()
    made.clear()
    assert run_reproduction(short(tmp_path)).read_text() == first
    assert made == []


def test_interruption_keeps_finished_parts(tmp_path, made, without_figures, monkeypatch, capsys):
    def interrupted(setting, on_progress):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(reproduce, "run_transport", interrupted)
        with pytest.raises(SystemExit) as stop:
            run_reproduction(short(tmp_path))
    assert stop.value.code == 130
    assert "running the same command again" in capsys.readouterr().out
    made.clear()
    run_reproduction(short(tmp_path))
    assert made == ["transport"]


def test_other_settings_and_damage_need_fresh(tmp_path, made, without_figures):
    run_reproduction(short(tmp_path))
    with pytest.raises(RecordError, match="--fresh"):
        run_reproduction(short(tmp_path, max_duration_s=1.2))
    (tmp_path / "out/parts/l1.npz").write_bytes(b"PK")
    with pytest.raises(RecordError, match="--fresh"):
        run_reproduction(short(tmp_path))
    made.clear()
    run_reproduction(short(tmp_path, max_duration_s=1.2, fresh=True))
    assert len(made) == 4


def test_bad_settings_are_refused(tmp_path):
    for duration in (0.0, 0.5, float("nan")):
        with pytest.raises(ParameterError, match="max_duration_s"):
            short(tmp_path, max_duration_s=duration)
    (tmp_path / "out").write_text("mine")
    with pytest.raises(RecordError, match="a folder that can be written"):
        run_reproduction(short(tmp_path))


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["--help"], 0, "--output-dir"),
        (["--max-duration-s", "-1"], 2, "max_duration_s"),
        (["--speed", "1"], 2, "--speed"),
    ],
)
def test_the_command_answers_for_itself(words, code, said, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["defmanip", "reproduce", *words])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    assert stop.value.code == code
    answer = capsys.readouterr()
    assert said in answer.out + answer.err


def test_the_page_in_docs_shows_its_numbers_and_images():
    folder = "images/reproduction/"
    numbers = json.loads((DOCS / folder / "numbers.json").read_text())
    page = (DOCS / "reproduction.md").read_text()
    assert page == render_page(numbers, image_folder=folder)
    images = re.findall(r"\]\(([^)]+\.png)\)", page)
    assert images == [f"{folder}{name}.png" for name in FIGURES]
    assert all((DOCS / image).stat().st_size > 1000 for image in images)


def same(found, expected):
    """Whether numbers are the same but for what another processor's rounding makes of them."""
    if isinstance(expected, dict):
        return set(found) == set(expected) and all(same(found[k], expected[k]) for k in expected)
    if isinstance(expected, list):
        return len(found) == len(expected) and all(map(same, found, expected))
    if isinstance(expected, float):
        return found == pytest.approx(expected, rel=1e-4, abs=1e-9)
    return found == expected


def test_the_page_in_docs_is_what_the_command_makes_today():
    numbers = json.loads((DOCS / "images/reproduction/numbers.json").read_text())
    for name in ("l1", "damping_study"):
        assert same(STUDIES[name](100.0).numbers, numbers[name])
    setting = paper_setting(max_duration_s=10.0)  # of nine hours: settings, and the opening
    found, expected = (
        summarize(setting, run_transport(setting, lambda _: None)),
        numbers["transport"],
    )
    assert found.keys() == expected.keys()
    whole = {"duration_s", "converged", "largest_velocity_m_s"}
    for key in found.keys() - {key for key in found if key.startswith("final_")} - whole:
        if key == "force_error":
            found[key]["final_rms_m_s2"] = expected[key]["final_rms_m_s2"]
        assert same(found[key], expected[key]), key


def test_the_page_in_docs_is_of_a_full_run():
    numbers = json.loads((DOCS / "images/reproduction/numbers.json").read_text())
    transport = numbers["transport"]
    assert transport["nu_max"] == pytest.approx(paper_nu_max(), rel=1e-9)
    assert transport["converged"] and transport["final_distance_m"] < 0.05
    assert transport["largest_swing_rad"] < transport["sigma_rad"]
    assert max(transport["largest_velocity_m_s"]) <= transport["speed_bound_m_s"] * 1.02
    assert numbers["l1"]["outcome"] == "success"
