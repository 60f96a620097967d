"""What docs/data.md shows works, in its order, with fewer episodes."""

import re
import shlex
import sys
from pathlib import Path

import pytest

from defmanip_gym import cli

PAGE = (Path(__file__).parents[2] / "docs" / "data.md").read_text()
BLOCKS = re.findall(r"```(sh|python)\n(.*?)```", PAGE, re.S)


def run_line(line, monkeypatch):
    words = shlex.split(line.replace("--episodes 1000", "--episodes 4"))
    if words[0] == "export":
        monkeypatch.setenv(*words[1].split("="))
        return
    monkeypatch.setattr(sys, "argv", words)
    cli.main()


def test_the_blocks_run_one_after_another(tmp_path, monkeypatch, capsys):
    for module in ("minari", "h5py", "onnx", "onnxruntime", "stable_baselines3"):
        pytest.importorskip(module)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", "elsewhere")
    for language, text in BLOCKS:
        if language == "python":
            exec(compile(text, "data.md", "exec"), {})
            continue
        for line in text.splitlines():
            run_line(line, monkeypatch)
    answer = capsys.readouterr().out
    assert re.search(r"^field 0\.\d+|^field 1\.\d+", answer, re.M)
    assert answer.splitlines()[-1] == "True"
    assert {path.name for path in tmp_path.iterdir()} == {
        "datasets",
        "sac.onnx",
        "ppo.zip",
        "ppo_vecnormalize.pkl",
    }


def test_the_page_names_extras_that_there_are():
    text = (Path(__file__).parents[2] / "pyproject.toml").read_text()
    for extra in re.findall(r"defmanip_gym\[(\w+)\]", PAGE):
        assert f"\n{extra} = [" in text
