"""The commands answer for themselves: help, wrong input, and no tracebacks."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TRAINS = pytest.mark.skipif(find_spec("torch") is None, reason="could not import 'torch'")


def run(*words, cwd=ROOT):
    return subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, cwd=cwd, timeout=300
    )


@pytest.mark.parametrize("script", ["train.py", "evaluate.py"])
def test_help_describes_options_and_shows_examples(script):
    answer = run(script, "--help")
    assert answer.returncode == 0
    assert "--seed" in answer.stdout or "--episodes" in answer.stdout
    assert f"python {script}" in answer.stdout


def test_defmanip_lists_its_commands():
    answer = run("-m", "defmanip_gym", "--help")
    assert answer.returncode == 0
    assert "train" in answer.stdout and "compare" in answer.stdout


@pytest.mark.parametrize("words", [("--help",), ("agents",)])
def test_a_reader_that_goes_away_ends_a_command_quietly(words):
    program = subprocess.Popen(
        [sys.executable, "-m", "defmanip_gym", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    program.stdout.close()
    assert program.stderr.read() == ""
    assert program.wait() != 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("train.py", "--seed", "-1"), "seed"),
        pytest.param(("train.py", "--resume", "nowhere"), "train.py", marks=TRAINS),
        (("train.py", "--algo", "dqn"), "ppo"),
        (("evaluate.py", "--contestants", "nobody"), "tanner/l1"),
        (("evaluate.py", "--suites", "nomnial"), "mismatch"),
        (("evaluate.py", "--agents", "nothing.safetensors"), "nothing.json"),
        (("evaluate.py", "--episodes", "0"), "episodes"),
        (("evaluate.py", "--agents", "[odd].safetensors"), "[odd].json"),
    ],
)
def test_wrong_input_gets_a_message_and_no_traceback(words, said, tmp_path):
    output = ("--output", str(tmp_path / "out"))
    answer = run(*words, *output)
    assert answer.returncode == 2
    assert said in answer.stderr + answer.stdout
    assert "Traceback" not in answer.stderr
    assert not list(tmp_path.rglob("*.jsonl"))


def test_without_the_packages_for_training_the_remedy_is_named():
    missing = "import sys; sys.modules['stable_baselines3'] = None"
    answer = run("-c", f"{missing}; from defmanip_gym.cli import train_main; train_main()")
    assert answer.returncode == 2
    assert "defmanip_gym[train]" in "".join(answer.stderr.split())
    assert "Traceback" not in answer.stderr
