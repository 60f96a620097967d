"""How long a safety filter alone takes to decide, while a controller pumps the swing against it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.envs.deform_transport import DeformTransportEnv
from defmanip_gym.evaluation.conditions import NOMINAL_BEAM, Condition
from defmanip_gym.evaluation.protection import Protection
from defmanip_gym.files import write_atomically
from defmanip_gym.observation import ObservationLayout

Array = NDArray[np.float64]

FILTER_TIMING_FILE = "filter_timings.json"  # in the output folder

_WARM_UP, _SAMPLES = 50, 2000


@dataclass(frozen=True, kw_only=True)
class FilterTimes:
    """Wall times of ``certify_action`` with ``conclude`` for one episode, s."""

    median_s: float
    p99_s: float


def filter_times(protection: Protection) -> FilterTimes:
    """Return how long a filter takes on the nominal plant, n = 1.

    The wished command is the largest one that feeds the swing, so that the filter has to change
    many of them.
    """
    condition = Condition(name="nominal")
    config = condition.environment
    safety_filter = protection.filter_for(condition)
    env = DeformTransportEnv(constraint_mode="cost", nominal_beam=config.nominal_beam)
    layout, limit = ObservationLayout(NOMINAL_BEAM.segment_count), config.task.max_acceleration_m_s2
    memory, started, seed = safety_filter.memory(1), np.array([True]), 0
    observation, ended = env.reset(seed=seed)[0][None].copy(), False
    safety_filter.begin(memory, observation, started)
    samples = []
    for _ in range(_WARM_UP + _SAMPLES):
        if ended:
            seed += 1
            observation = env.reset(seed=seed)[0][None].copy()
            safety_filter.begin(memory, observation, started)
        wished = _feeding(layout, observation, limit)
        begin = time.perf_counter()
        allowed = safety_filter.certify_action(wished, observation, memory).allowed_m_s2
        decided = time.perf_counter()
        after, _, terminated, truncated, _ = env.step(allowed[0] / limit)
        observation, ended = after[None].copy(), terminated or truncated
        again = time.perf_counter()
        safety_filter.conclude(observation, memory)
        samples.append(time.perf_counter() - again + decided - begin)
    env.close()
    median_s, p99_s = np.quantile(samples[_WARM_UP:], (0.5, 0.99)).tolist()
    return FilterTimes(median_s=median_s, p99_s=p99_s)


def measured_filter_times(
    path: Path,
    protections: Iterable[Protection],
    measure: Callable[[Protection], FilterTimes] = filter_times,
) -> dict[str, FilterTimes]:
    """Return the times by the filters' names; measure and keep those that are not yet known.

    Args:
        path: of the file; one that cannot be understood is written anew.
        protections: who is to be timed.
        measure: returns the times of one.
    """
    known = read_filter_times(path)
    wanted = {protection.method: protection for protection in protections}
    missing = {name: measure(each) for name, each in wanted.items() if name not in known}
    if missing:
        known |= missing
        content = {name: asdict(times) for name, times in known.items()}
        write_atomically(path, (json.dumps(content, indent=2) + "\n").encode())
    return {name: known[name] for name in wanted}


def read_filter_times(path: Path) -> dict[str, FilterTimes]:
    """Return the times in a file by the filters' names; none where there are none."""
    try:
        content = json.loads(path.read_text())
        return {name: FilterTimes(**times) for name, times in content.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}


def _feeding(layout: ObservationLayout, observation: Array, limit_m_s2: float) -> Array:
    """Return the command that takes the grasp away from under the swing, (1, 3) m/s²."""
    rate = layout.part(observation, "swing_rate")[:, :1]
    return np.hstack((np.where(rate > 0, -limit_m_s2, limit_m_s2), np.zeros((1, 2))))
