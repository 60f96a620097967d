"""Attacks certificates through the real environment, with random beams, robots and periods.

Every case draws an environment that the constructors accept and a certificate for its beam, half of
them with the room for errors that ``certificate_for`` finds, the others with that of
``TRANSPORT_CONDITIONS``. Attackers then push in resonance with the swing while they turn and lift
as wildly as they can. A case is a line of the output; cases that are there are not run again.

    python benchmarks/attacks/attack_environments.py --cases 400 --output results/attacks.jsonl
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from defmanip_gym.errors import DefmanipError
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.params import (
    PAPER_DISTURBANCE,
    BeamParams,
    DisturbanceParams,
    LinkParams,
    RobotParams,
)
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.wrappers.certificate_for import certificate_for
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling

Rng = np.random.Generator
Attacker = Callable[[np.ndarray, np.ndarray, int, Rng], np.ndarray]

EPISODES = 100  # of a case, shared by the attackers


def drawn_environment(rng: Rng) -> dict[str, Any]:
    """Return arguments of an environment."""
    segments = int(rng.choice([1, 1, 1, 2, 3, 4]))
    length = float(rng.uniform(0.1, 1.2))
    beam = BeamParams(
        mass_kg=float(np.exp(rng.uniform(np.log(0.5), np.log(10.0)))),
        length_m=length,
        damping=float(np.exp(rng.uniform(np.log(0.01), np.log(3.0)))),
        segment_count=segments,
        joint_stiffness=float(np.exp(rng.uniform(np.log(1.0), np.log(50.0)))),
        joint_damping=float(np.exp(rng.uniform(np.log(0.05), np.log(1.0)))),
        root_stiffness=float(rng.choice([0.0, 0.0, 5.0])),
        radius_m=min(0.02, 0.4 * length / segments),
    )
    size = float(rng.uniform(0.8, 1.25))
    robot = RobotParams(
        base_mass_kg=float(rng.uniform(20, 100)),
        upper_arm=LinkParams(length_m=0.6 * size, mass_kg=float(rng.uniform(2, 8))),
        forearm=LinkParams(length_m=0.7 * size, mass_kg=float(rng.uniform(1, 5))),
        joint_armature_kgm2=float(rng.uniform(0.0, 2.0)),
        steering_torque_limit_nm=float(rng.choice([20.0, 120.0, 120.0])),
        shoulder_torque_limit_nm=float(rng.choice([100.0, 250.0, 250.0])),
    )
    physics = float(rng.choice([0.002, 0.005, 0.005, 0.01]))
    task = TaskParams(
        physics_period_s=physics,
        control_period_s=physics * int(rng.choice([1, 2, 4, 4, 10])),
        max_acceleration_m_s2=float(rng.choice([0.5, 1.0, 3.0, 3.0, 4.0, 20.0])),
        max_speed_m_s=float(rng.choice([0.5, 1.0, 2.0, 2.0, 4.0])),
    )
    belief = rng.choice(["default", "true", "other damping", "other mass"])
    nominal = {
        "default": None,
        "true": beam,
        "other damping": replace(beam, damping=beam.damping * float(rng.uniform(0.0, 3.0))),
        "other mass": replace(beam, mass_kg=beam.mass_kg * float(rng.uniform(0.9, 1.1))),
    }[str(belief)]
    disturbance = rng.choice(
        np.array(
            [
                DisturbanceParams(),
                DisturbanceParams(),
                PAPER_DISTURBANCE,
                DisturbanceParams(
                    force_amplitude_n=float(rng.uniform(0.0, 2.0)),
                    force_frequency_rad_s=float(rng.uniform(1.0, 12.0)),
                ),
            ],
            dtype=object,
        )
    )
    return {
        "beam": beam,
        "robot": robot,
        "task": task,
        "nominal_beam": nominal,
        "disturbance": disturbance,
    }


def resonant(swing: np.ndarray, rate: np.ndarray, step: int, rng: Rng) -> np.ndarray:
    """Push with the swing, pump the vertical at twice its frequency, turn as fast as allowed."""
    return np.stack(
        (-np.sign(rate[:, 0] + 1e-9), np.ones(len(rate)), np.sign(swing[:, 0] * rate[:, 0])), axis=1
    )


def straight(swing: np.ndarray, rate: np.ndarray, step: int, rng: Rng) -> np.ndarray:
    """Push with the swing of the first segment, and nothing else."""
    action = np.zeros((len(rate), 3))
    action[:, 0] = -np.sign(rate[:, 0] + 1e-9)
    return action


def tip(swing: np.ndarray, rate: np.ndarray, step: int, rng: Rng) -> np.ndarray:
    """Push with the swing of the last segment while lifting."""
    action = np.ones((len(rate), 3))
    action[:, 0] = -np.sign(rate[:, -1] + 1e-9)
    action[:, 1] = -1.0
    return action


def wild(swing: np.ndarray, rate: np.ndarray, step: int, rng: Rng) -> np.ndarray:
    """Push with the swing while turning and lifting erratically."""
    action = np.sign(rng.uniform(-1, 1, (len(rate), 3)))
    action[:, 0] = -np.sign(rate[:, 0] + 1e-9)
    return action


def holding(swing: np.ndarray, rate: np.ndarray, step: int, rng: Rng) -> np.ndarray:
    """Push with the swing, and change what the other axes do every seventh period."""
    action = np.sign(np.random.default_rng(step // 7).uniform(-1, 1, (len(rate), 3)))
    action[:, 0] = -np.sign(rate[:, 0] + 1e-9)
    return action


ATTACKERS: tuple[Attacker, ...] = (resonant, straight, tip, wild, holding)


def run_case(seed: int, duration_s: float) -> dict[str, Any]:
    """Attack one environment; return what happened."""
    rng = np.random.default_rng(seed)
    arguments = drawn_environment(rng)
    task, segments = arguments["task"], arguments["beam"].segment_count
    steps = round(duration_s / task.control_period_s)
    env = gymnasium.make_vec(
        "defmanip_gym:DeformTransport-v0",
        num_envs=EPISODES,
        autoreset_mode="Disabled",
        constraint_mode="cost",
        max_episode_steps=steps + 1,
        **arguments,
    )
    method = "phase_plane" if segments == 1 else "l1"
    has_own_room = bool(rng.integers(2))
    if has_own_room:
        certificate = certificate_for(env.unwrapped.config, method=method)
    else:
        certificate = certify(
            arguments["beam"], method=method, conditions=TRANSPORT_CONDITIONS
        ).proven()
    wrapped = NuMaxVectorActionScaling(env, certificate)
    observation, info = wrapped.reset(seed=1000 * seed)
    promised = info["certificate_applies"].copy()
    layout, running = ObservationLayout(segments), np.ones(EPISODES, dtype=bool)
    broken = np.zeros(EPISODES, dtype=bool)
    beyond = np.zeros(EPISODES, dtype=bool)
    withdrawn = np.zeros(EPISODES, dtype=bool)
    largest, claims = 0.0, promised.any()
    for step in range(steps if claims else 0):
        swing, rate = layout.part(observation, "swing"), layout.part(observation, "swing_rate")
        action = np.empty((EPISODES, 3))
        for index, attacker in enumerate(ATTACKERS):
            rows = slice(index, None, len(ATTACKERS))
            action[rows] = attacker(swing[rows], rate[rows], step, rng)
        observation, _, terminated, _, info = wrapped.step(action)
        applies = info["certificate_applies"]
        share = 1 - info["constraint_margin"] / env.unwrapped.config.sigma_rad
        broken |= running & applies & (share > 1)
        beyond |= running & promised & (share > 1)
        withdrawn |= running & promised & ~applies
        largest = max(largest, float(share[running & applies].max(initial=0.0)))
        running &= ~terminated
    wrapped.close()
    return {
        "seed": seed,
        "segments": segments,
        "own_room": has_own_room,
        "bound_m_s2": certificate.acceleration_bound,
        "applies": int(promised.sum()),
        "withdrawn": int(withdrawn.sum()),
        "broken": int(broken.sum()),
        "exceeded_after_withdrawal": int((beyond & ~broken).sum()),
        "largest_swing_share": largest,
        "reason": str(info["certificate_reason"][0]),
    }


def main() -> None:
    """Run the cases that are missing and print the sums."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cases", type=int, default=400)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--duration-s", type=float, default=20.0)
    parser.add_argument("--output", type=Path, default=Path("results/attacks.jsonl"))
    options = parser.parse_args()
    options.output.parent.mkdir(parents=True, exist_ok=True)
    lines = options.output.read_text().splitlines() if options.output.exists() else []
    known = {record["seed"]: record for record in map(json.loads, lines)}
    for seed in range(options.first, options.first + options.cases):
        if seed in known:
            continue
        try:
            known[seed] = run_case(seed, options.duration_s)
        except DefmanipError as error:  # refused: no such environment or certificate
            known[seed] = {"seed": seed, "refused": type(error).__name__}
        with options.output.open("a") as file:
            file.write(json.dumps(known[seed]) + "\n")
    _print_sums(list(known.values()))


def _print_sums(records: list[dict[str, Any]]) -> None:
    run = [record for record in records if "refused" not in record]
    claimed = [record for record in run if record["applies"]]
    print(f"cases: {len(records)}, refused by constructors: {len(records) - len(run)}")
    print(f"cases in which a certificate applies: {len(claimed)} of {len(run)}")
    for name in ("applies", "withdrawn", "broken", "exceeded_after_withdrawal"):
        print(f"episodes, {name}: {sum(record[name] for record in run)}")
    largest = max((record["largest_swing_share"] for record in claimed), default=0.0)
    print(f"largest swing while a certificate applied: {largest:.4f} σ")


if __name__ == "__main__":
    main()
