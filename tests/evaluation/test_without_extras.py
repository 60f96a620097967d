"""A comparison needs none of the optional packages."""

import subprocess
import sys

CODE = """
import sys
sys.modules.update(dict.fromkeys(("casadi", "daqp")))
from defmanip_gym.evaluation.contestants import standard_contestants, standard_names
from defmanip_gym.evaluation.protection import Certificates
from defmanip_gym.evaluation.timings import decision_time_s

names = standard_names()
assert "time_optimal" in names and "mpc" not in names
for contestant in standard_contestants(["time_optimal", "field", "lqr"], Certificates()):
    decision_time_s(contestant)
"""


def test_the_standard_contestants_run_and_are_timed_without_extras():
    subprocess.run([sys.executable, "-c", CODE], check=True, timeout=120)
