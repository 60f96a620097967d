"""Without the optional packages the commands name the remedy, before anything is run."""

import sys

import pytest

from defmanip_gym.baselines.learned.agents import load_agent
from defmanip_gym.datasets.command import run_dataset
from defmanip_gym.datasets.config import DatasetConfig
from defmanip_gym.errors import InstallationError
from defmanip_gym.exports.onnx_graph import onnx_bytes


@pytest.mark.parametrize("missing", ["minari", "h5py"])
def test_writing_and_checking_name_the_extra(missing, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, missing, None)
    (tmp_path / "some-v0" / "data").mkdir(parents=True)
    for settings in ({"name": "some-v0", "contestants": ("zero",)}, {"check": "some-v0"}):
        with pytest.raises(InstallationError, match=r"defmanip_gym\[data\]"):
            run_dataset(DatasetConfig(output=tmp_path, **settings))


def test_onnx_files_name_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(InstallationError, match=r"defmanip_gym\[onnx\]"):
        onnx_bytes(load_agent("sac"))
