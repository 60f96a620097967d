"""Attacks the filter for objects from files, on the rig: in all directions, turning, undamped.

Every case takes an example or draws an object of links (``drawn_objects``), errors of acceleration
and a delay, and makes the filter with ``object_filter_for``. A thousand attackers
(``filter_attackers``) that know the object's momenta play through it, carried by robots that turn
as they must (``objects.rig_robot``); half of the errors feed the swing, half are at random; a third
of the starts store just the level. A case is a line of the output; cases that are there are not run
again.

    python benchmarks/attacks/attack_objects.py --cases 60
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections import defaultdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from defmanip_gym.envs.config import TransportConfig
from defmanip_gym.envs.workspace import in_workspace, workspace_of
from defmanip_gym.errors import DefmanipError
from defmanip_gym.objects.mjcf_object import mjcf_object
from defmanip_gym.objects.object_filter_for import object_filter_for, storing
from defmanip_gym.objects.rig_robot import RigRobot
from defmanip_gym.observation import ObservationLayout
from defmanip_gym.plant.object_rig import ObjectRig
from defmanip_gym.theory.dynamics.robot_model import JOINT_TO_PITCH
from defmanip_gym.theory.filters.linkage_bounds import look
from defmanip_gym.theory.filters.object_filter import ObjectConditions, ObjectStorageFilter
from defmanip_gym.wrappers.rig_promise import RigPromise
from drawn_objects import object_file
from filter_attackers import ATTACKS, Attackers, Seen, sign

Rng = np.random.Generator
EPISODES = 1000  # of a case
_KEPT = 0.95  # of the errors provided for: the rest is what the rig adds


class ObjectSeen(Seen):
    """What attackers of objects look at: signs of what feeds the storage, by the object's M."""

    def __init__(
        self, made: ObjectStorageFilter, layout: ObservationLayout, observation: np.ndarray
    ) -> None:
        super().__init__(layout, observation)
        z2, rate = layout.part(observation, "swing"), layout.part(observation, "swing_rate")
        momenta = np.einsum("nkj,nj->nk", look(made.setup.model, z2).coupling, rate)
        self.momenta = momenta[:, :3]
        self.forward, self.leftward, self.upward = (sign(each) for each in momenta[:, :3].T)
        self.twisting = sign(-momenta[:, 3])


class Errors:
    """Accelerations beside what is foreseen, (n, 3): changes and sizes as a filter provides for."""

    def __init__(self, made: ObjectStorageFilter, count: int, rng: Rng) -> None:
        self._change = _KEPT * np.array(made.errors_m_s2)
        self._size = _KEPT * np.array(made.offsets_m_s2)
        self._feeding, self._rng = rng.random(count) < 0.5, rng
        self.now = np.zeros((count, 3))

    def next(self, momenta: np.ndarray) -> np.ndarray:
        """Return those of a period, with the swing or at random."""
        drawn = self._rng.uniform(-1, 1, self.now.shape) * self._change
        feeding = np.clip(-self._size * np.sign(momenta) - self.now, -self._change, self._change)
        step = np.where(self._feeding[:, None], feeding, drawn)
        self.now = np.clip(self.now + step, -self._size, self._size)
        return self.now


def drawn_conditions(rng: Rng) -> ObjectConditions:
    """Return errors and a delay: the robot's own, smaller or larger ones."""
    size = float(rng.choice([0.05, 1.0, 1.0, 1.5]))
    ours = ObjectConditions()
    names = [name for name in ObjectConditions.__dataclass_fields__ if name.endswith("_m_s2")]
    errors = {name: size * getattr(ours, name) for name in names}
    return ObjectConditions(**errors, delay_periods=int(rng.choice([0, 0, 0, 1, 2, 3])))


def run_case(seed: int, steps: int) -> dict[str, Any]:
    """Attack one object; return what happened."""
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        path, name = object_file(Path(folder), seed)
        thing = mjcf_object(path, grasp_site="grasp")
    conditions = drawn_conditions(rng)
    delay = conditions.delay_periods
    made = object_filter_for(thing, conditions=conditions)
    robot = RigRobot(ObjectRig(thing.rig(), count=EPISODES, num_threads=1), made.setup.limits)
    speed, course = rng.uniform(0, 1.9, EPISODES), rng.uniform(-0.7, 0.7, EPISODES)
    speed *= rng.choice((-1.0, 0.0, 1.0), EPISODES)
    velocity = np.stack((speed * np.cos(course), speed * np.sin(course)), axis=1)
    pitch = np.tile(JOINT_TO_PITCH @ np.array(made.task.goal[3:5]), (EPISODES, 1))
    nothing = np.zeros((EPISODES, made.segment_count))
    rows = robot.place(pitch, nothing, nothing, velocity_b=velocity)
    shares = np.where(rng.random(EPISODES) < 1 / 3, 0.9999, rng.uniform(0, 0.99, EPISODES))
    yaw_rate = robot.layout.part(rows, "base_velocity")[:, 1]
    z2, rate, _ = storing(made, shares, yaw_rate, rng)
    observation = robot.place(pitch, z2, rate, velocity_b=velocity)

    memory, every = made.memory(EPISODES), np.ones(EPISODES, dtype=bool)
    made.begin(memory, observation, every)
    promise = RigPromise(thing.linkage(), made.setup.limits, made, EPISODES, delay)
    promise.begin(observation, memory, every)
    see = partial(ObjectSeen, made)
    attackers = Attackers(robot.layout, EPISODES, rng, names=tuple(ATTACKS), see=see)
    errors, under_way = Errors(made, EPISODES, rng), [np.zeros((EPISODES, 3))] * delay
    ever, broken, beyond, withdrawn = promise.applies, ~every, ~every, ~every
    space, running = workspace_of(TransportConfig(task=made.task)), every.copy()
    largest, stored = np.zeros(EPISODES), np.zeros(EPISODES)
    for step in range(steps):
        wished = made.task.max_acceleration_m_s2 * attackers.act(observation, step)
        under_way.append(made.certify_action(wished, observation, memory).allowed_m_s2)
        beside = errors.next(see(robot.layout, observation).momenta)
        observation = robot.step(under_way.pop(0), beside)
        promise.watch(made.conclude(observation, memory), observation, memory, None)
        share, applies = robot.peak.max(axis=1) / made.sigma_rad, promise.applies
        ever = ever | (running & applies)
        broken |= running & applies & (share > 1)
        beyond |= running & ever & (share > 1)
        withdrawn |= running & ever & ~applies
        np.maximum(largest, np.where(running & applies, share, 0.0), out=largest)
        ended = running & ~in_workspace(0.0, 0.0, *robot.pitch.T, space)
        robot.halt(ended)
        running &= ~(ended | robot.rig.diverged)
        now = made.storage_shares(observation, memory) * made.level_share
        np.maximum(stored, np.where(running & applies, now, 0.0), out=stored)
    kinds = {
        kind: round(float(stored[attackers.kinds == index].max(initial=0.0)), 4)
        for index, kind in enumerate(ATTACKS)
    }
    return {
        "seed": seed,
        "object": name,
        "coordinates": made.segment_count,
        "directions": int((made._bounds.momenta[:2] > 0.05 * made._bounds.momenta.max()).sum()),
        "damped": bool(thing.linear.d_o22.any()),
        "delay": delay,
        "level_share": made.level_share,
        "storage_error": made.conditions.storage_error,
        "applies": int(ever.sum()),
        "withdrawn": int(withdrawn.sum()),
        "left_workspace": int((~running).sum()),
        "broken": int(broken.sum()),
        "exceeded_after_withdrawal": int((beyond & ~broken).sum()),
        "diverged": int(robot.rig.diverged.sum()),
        "largest_swing_share": float(largest.max()),
        "largest_storage_share": float(stored.max()),
        "storage_by_attacker": kinds,
        "reason": str(next((reason for reason in promise.reasons if reason), "")),
    }


def main() -> None:
    """Run the cases that are missing and print the sums."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--steps", type=int, default=250)
    parser.add_argument("--output", type=Path, default=Path("results/attacks-objects.jsonl"))
    options = parser.parse_args()
    output: Path = options.output
    output.parent.mkdir(parents=True, exist_ok=True)
    lines = output.read_text().splitlines() if output.exists() else []
    known = {record["seed"]: record for record in map(json.loads, lines)}
    for seed in range(options.first, options.first + options.cases):
        if seed in known:
            continue
        try:
            known[seed] = run_case(seed, options.steps)
        except DefmanipError as error:  # no filter for such an object
            known[seed] = {"seed": seed, "refused": f"{type(error).__name__}: {error}"}
        with output.open("a") as file:
            file.write(json.dumps(known[seed]) + "\n")
    _print_sums(list(known.values()))


def _print_sums(records: list[dict[str, Any]]) -> None:
    run = [record for record in records if "refused" not in record]
    print(f"cases: {len(records)}, without a filter: {len(records) - len(run)}")
    groups = defaultdict(list)
    for record in run:
        groups[record["object"]].append(record)
    for name, group in sorted(groups.items()):
        sums = {
            key: sum(record[key] for record in group)
            for key in ("applies", "withdrawn", "broken", "exceeded_after_withdrawal", "diverged")
        }
        swing = max(record["largest_swing_share"] for record in group)
        stored = max(record["largest_storage_share"] for record in group)
        print(f"{name}: {len(group)} cases, episodes {sums}, {swing:.4f} σ, {stored:.4f} V_σ")


if __name__ == "__main__":
    main()
