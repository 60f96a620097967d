"""How much a storage filter can cover, and how much breaks one that was made for nothing of it.

Each line is a size of one deviation: the share of V_σ that a filter made for it keeps (or why there
is none), what attackers reach through that, and what they reach through the nominal filter, whose
promise then does not apply.

    python benchmarks/attacks/filter_limits.py
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np

from defmanip_gym.errors import CertificateError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import BeamParams, BeamRanges, DisturbanceParams, RobotParams
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.action_delay import ActionDelay
from defmanip_gym.wrappers.filter_for import filter_for
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper
from filter_attackers import Attackers

BEAM = BeamParams()
NOMINAL = {"nominal_beam": replace(BEAM, damping=0.0)}


def within(factor: float, *names: str) -> dict[str, Any]:
    """Return arguments of beams whose parameters lie within a factor of the nominal ones."""
    ends = {
        name: ((1 - factor) * getattr(BEAM, name), (1 + factor) * getattr(BEAM, name))
        for name in names
    }
    return {"beam_ranges": BeamRanges(**ends)} | NOMINAL


def deviations() -> dict[str, tuple[dict[str, Any], int]]:
    """Return environments, and control periods of delay, by what deviates."""
    made: dict[str, tuple[dict[str, Any], int]] = {"nothing": (NOMINAL, 0)}
    for share in (0.05, 0.2, 0.35, 0.5):
        made[f"mass ±{share:.0%}"] = within(share, "mass_kg"), 0
        made[f"length ±{share:.0%}"] = within(share, "length_m"), 0
    for periods in (1, 3, 6, 12, 25):
        made[f"delay {20 * periods} ms"] = NOMINAL, periods
    for noise in (0.01, 0.02, 0.05, 0.1):
        disturbance = DisturbanceParams(swing_sensor_noise_rad=noise)
        made[f"noise {noise:g} rad"] = NOMINAL | {"disturbance": disturbance}, 0
    for force in (2.0, 5.0, 10.0, 20.0):
        disturbance = DisturbanceParams(force_amplitude_n=force, force_frequency_rad_s=5.0)
        made[f"force {force:g} sin 5t N"] = NOMINAL | {"disturbance": disturbance}, 0
    for drive in (200.0, 100.0, 50.0):
        made[f"drive {drive:g} N"] = NOMINAL | {"robot": RobotParams(drive_force_limit_n=drive)}, 0
    return made


def reached(
    made: StorageFilter, arguments: dict[str, Any], delay: int, count: int, not_covered: bool
) -> float:
    """Return the largest swing over σ that attackers reach."""
    env = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0",
        num_envs=count,
        autoreset_mode="Disabled",
        constraint_mode="cost",
        **arguments,
    )
    wrapped = SafetyFilterVectorWrapper(ActionDelay(env, delay), made)
    observation, _ = wrapped.reset(seed=0)
    attackers = Attackers(ObservationLayout(1), count, np.random.default_rng(0))
    running, largest = np.ones(count, dtype=bool), 0.0
    for step in range(250):
        observation, _, terminated, _, info = wrapped.step(attackers.act(observation, step))
        share = 1 - info["constraint_margin"] / made.sigma_rad
        covered = running & (info["filter_applies"] | not_covered)
        largest = max(largest, float(share[covered].max(initial=0.0)))
        running &= ~terminated
    wrapped.close()
    return largest


def main() -> None:
    """Print a line for each deviation."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--episodes", type=int, default=200)
    options = parser.parse_args()
    nominal = StorageFilter(BEAM)
    print("| deviation | level / V_σ | attacked | attacked through the nominal filter |")
    print("| --- | --- | --- | --- |")
    for name, (arguments, delay) in deviations().items():
        env = gymnasium.make_vec("defmanip_gym:DeformTransport-v0", num_envs=1, **arguments)
        config = env.unwrapped.config
        try:
            made = filter_for(config, beam=BEAM, delay_periods=delay)
            cells = (
                f"{made.level_share:.2f}",
                f"{reached(made, arguments, delay, options.episodes, False):.2f} σ",
            )
        except CertificateError as error:
            cells = "none", f"{error.name} too large"
        alone = reached(nominal, arguments, delay, options.episodes, True)
        print(f"| {name} | {cells[0]} | {cells[1]} | {alone:.2f} σ |", flush=True)


if __name__ == "__main__":
    main()
