"""The quadratic program's solver is optional, and asked for when a filter is made."""

import subprocess
import sys

import pytest

from defmanip_gym.errors import InstallationError
from defmanip_gym.theory.filters.qp_filter import CbfQpFilter


def test_without_its_solver_the_filter_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "daqp", None)  # as if it were not installed
    with pytest.raises(InstallationError, match=r"defmanip_gym\[qp\]"):
        CbfQpFilter()


def test_its_module_does_not_load_the_solver():
    code = (
        "import sys, defmanip_gym.theory.filters.qp_filter; "
        "sys.exit('loaded' if 'daqp' in sys.modules else 0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
