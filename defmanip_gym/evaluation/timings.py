"""How long a decision takes; apart from the records, which are the same on every machine."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

import numpy as np

from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.evaluation.conditions import Condition
from defmanip_gym.evaluation.contestant import Contestant
from defmanip_gym.files import write_atomically
from defmanip_gym.wrappers.filtering import Filtering

TIMING_FILE = "timings.json"  # in the output folder

_WARM_UP, _SAMPLES = 20, 300


def decision_time_s(contestant: Contestant) -> float:
    """Return the median wall time of ``predict`` on a batch of one, safety filter included, s."""
    condition = Condition(name="nominal")
    config = condition.environment_on(contestant.inner_loop)
    env = DeformTransportEnv(constraint_mode="cost", nominal_beam=config.nominal_beam)
    # where plans are stored from: a decision is timed, not the planning before the first one
    observation = env.reset(seed=0, options={"start": "paper"})[0][None]
    env.close()
    controller = contestant.members[0].controller.build([0])
    filtering = None
    if contestant.protection is not None:
        filtering = Filtering(config, contestant.protection.filter_for(condition))
        filtering.begin(observation, np.array([True]))
    state, samples = None, []
    for call in range(_WARM_UP + _SAMPLES):
        episode_start = np.array([call == 0])
        begin = time.perf_counter()
        actions, state = controller.predict(observation, state, episode_start, deterministic=True)
        if filtering is not None:
            filtering.certify(actions, observation)
            filtering.conclude(observation)
        samples.append(time.perf_counter() - begin)
    return median(samples[_WARM_UP:])


def measured_timings(
    path: Path,
    contestants: Sequence[Contestant],
    measure: Callable[[Contestant], float] = decision_time_s,
) -> dict[str, float]:
    """Return the decision times by contestant, s; measure and keep those that are not yet known.

    Args:
        path: of the file; one that cannot be understood is written anew, as it can be measured
            again at any time.
        contestants: who is to be timed.
        measure: returns the time of one.
    """
    known = read_timings(path)
    missing = {c.name: measure(c) for c in contestants if c.name not in known}
    if missing:
        known |= missing
        write_atomically(path, (json.dumps(known, indent=2) + "\n").encode())
    return {contestant.name: known[contestant.name] for contestant in contestants}


def read_timings(path: Path) -> dict[str, float]:
    """Return the decision times in a file, s; none where there are none."""
    try:
        content = json.loads(path.read_text())
    except (OSError, ValueError):
        return {}
    if not isinstance(content, dict):
        return {}
    return {name: value for name, value in content.items() if isinstance(value, float)}
