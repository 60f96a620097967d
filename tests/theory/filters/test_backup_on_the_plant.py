"""Backup: attackers play through it on the plant, and it gives more away than storage does."""

import math
from dataclasses import replace

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.params import BeamParams
from defmanip_gym.theory.filters.backup_filter import BackupFilter
from defmanip_gym.theory.filters.conditions import FilterConditions, PayloadIntervals
from defmanip_gym.theory.filters.storage_filter import StorageFilter

LARGEST = 3.0


def whip(segments, stiffness=5.0, joint_damping=0.02):
    return BeamParams(
        segment_count=segments,
        damping=0.0,
        joint_stiffness=stiffness,
        joint_damping=joint_damping,
    )


class Attack:
    """Held random corners of the action box; kinds replace components of them."""

    def __init__(self, kind, hold, count):
        self.kind, self.hold = kind, hold
        self.rng = np.random.default_rng(hold)
        self.held = np.zeros((count, 3))

    def wish(self, period, layout, observation):
        if period % self.hold == 0:
            self.held = self.rng.choice((-1.0, 1.0), self.held.shape)
        swing, rate = layout.part(observation, "swing"), layout.part(observation, "swing_rate")
        forward, turning = layout.part(observation, "base_velocity").T
        wished = self.held.copy()
        if self.kind in ("resonance", "all at once"):
            wished[:, 0] = -np.sign((rate * np.cos(swing)).sum(axis=1))
        if self.kind == "tip":
            wished[:, 0] = -np.sign(rate[:, -1])
        if self.kind in ("vertical", "all at once"):
            wished[:, 2] = -np.sign((rate * np.sin(swing)).sum(axis=1))
        if self.kind == "yaw":
            wished[:, 1] = np.where(turning * forward >= 0, 1.0, -1.0)
        return LARGEST * wished


def attacked(safety, beam, attack, *, periods=150, delay=0, noise_rad=0.0):
    """Return (largest |φ|/σ of those that went on, share of changed commands)."""
    count = len(attack.held)
    env = DeformTransportVectorEnv(
        count, constraint_mode="cost", beam=beam, autoreset_mode=AutoresetMode.DISABLED
    )
    observation, _ = env.reset(seed=attack.hold)
    layout, rng = env.unwrapped.engine.layout, np.random.default_rng(1)
    alive, changed, worst = np.ones(count, bool), [], 0.0

    def seen(truth):
        noisy = truth.copy()
        layout.part(noisy, "swing")[:] += noise_rad * rng.normal(size=(count, beam.segment_count))
        return noisy

    told = seen(observation)
    memory, under_way = safety.memory(count), [np.zeros((count, 3))] * delay
    safety.begin(memory, told, alive.copy())
    for period in range(periods):
        wished = attack.wish(period, layout, observation)
        allowed = safety.certify_action(wished, told, memory).allowed_m_s2
        changed.append(np.abs(allowed - wished).max(axis=1)[alive] > 1e-9)
        under_way.append(allowed)
        observation, _, terminated, _, _ = env.step(under_way.pop(0) / LARGEST)
        told = seen(observation)
        safety.conclude(told, memory)
        alive &= ~terminated  # out of the arm, or the plant itself diverges
        if alive.any():
            worst = max(worst, np.abs(layout.part(observation, "swing")[alive]).max())
    env.close()
    assert alive.mean() > 0.5
    return worst / safety.sigma_rad, np.concatenate(changed).mean()


@pytest.mark.parametrize("segments", [1, 2, 4, 8])
@pytest.mark.parametrize(
    ("kind", "hold"),
    [
        ("corners", 1),
        ("corners", 7),
        ("corners", 15),
        ("resonance", 15),
        ("tip", 5),
        ("vertical", 7),
        ("yaw", 7),
        ("all at once", 7),
    ],
)
def test_no_attacker_gets_beyond_sigma(segments, kind, hold):
    beam = whip(segments)
    worst, _ = attacked(BackupFilter(beam), beam, Attack(kind, hold, 16))
    assert 0.5 < worst <= 1.0


@pytest.mark.parametrize("beam", [whip(2, 0.5, 0.0), whip(4, 0.5, 0.2), whip(8, 20.0, 0.0)])
def test_neither_soft_nor_undamped_nor_stiff_chains_go_beyond_sigma(beam):
    for kind, hold in (("corners", 7), ("resonance", 15)):
        worst, _ = attacked(BackupFilter(beam), beam, Attack(kind, hold, 16))
        assert worst <= 1.0


@pytest.mark.parametrize("beam", [whip(4), whip(4, 0.5, 0.2), whip(8, 5.0, 0.2)])
def test_it_changes_much_less_of_a_whips_commands_than_storage(beam):
    changed = [
        attacked(kind(beam), beam, Attack("corners", 7, 16))[1]
        for kind in (StorageFilter, BackupFilter)
    ]
    assert changed[1] < 0.75 * changed[0]


@pytest.mark.parametrize("segments", [1, 4])
def test_it_accepts_whatever_storage_accepts(segments):
    beam = whip(segments)
    storage, backup = StorageFilter(beam), BackupFilter(beam)
    env = DeformTransportVectorEnv(32, beam=beam, autoreset_mode=AutoresetMode.DISABLED)
    observation, _ = env.reset(seed=0)
    layout, rng = env.unwrapped.engine.layout, np.random.default_rng(0)
    for part, spread in (("swing", 0.1), ("swing_rate", 0.3), ("grasp_velocity_b", 1.2)):
        values = layout.part(observation, part)
        values[:] = spread * rng.normal(size=values.shape)
    accepted = 0
    for _ in range(20):
        wished = rng.uniform(-LARGEST, LARGEST, (32, 3))
        kept = [
            (
                safety.certify_action(wished, observation, safety.memory(32)).allowed_m_s2 == wished
            ).all(axis=1)
            for safety in (storage, backup)
        ]
        assert kept[1][kept[0]].all()
        accepted += kept[0].sum()
    env.close()
    assert 20 < accepted < 620


def test_commands_under_way_are_foreseen():
    beam = whip(4)
    safety = BackupFilter(beam, conditions=FilterConditions(delay_periods=2))
    worst, _ = attacked(safety, beam, Attack("corners", 7, 16), delay=2)
    assert worst <= 1.0


def test_noise_on_the_swing_is_made_room_for():
    beam = BeamParams()
    safety = BackupFilter(beam, conditions=FilterConditions(swing_noise_rad=0.005))
    worst, _ = attacked(safety, beam, Attack("resonance", 15, 16), noise_rad=0.005)
    assert worst <= 1.0


@pytest.mark.parametrize("factors", [(0.1, 0.1), (0.1, 10.0), (10.0, 0.1), (3.0, 3.0)])
def test_damping_within_the_interval_stays_within_sigma(factors):
    """Held random corners with the believed damping in place of the true one reach 1.2 σ."""
    believed = BeamParams(segment_count=4, joint_stiffness=5.0, damping=0.1, joint_damping=0.2)
    root, joint = factors
    true = replace(believed, damping=root * 0.1, joint_damping=joint * 0.2)
    safety = BackupFilter(believed, intervals=PayloadIntervals(damping=(0.1, 10.0)))
    assert safety.covers(true)
    for kind, hold in (("corners", 7), ("tip", 5)):
        worst, _ = attacked(safety, true, Attack(kind, hold, 16))
        assert worst <= 1.0


@pytest.mark.parametrize("factors", [(0.8, 1.2), (1.2, 0.8), (1.2, 1.2)])
def test_mass_and_length_within_the_interval_stay_within_sigma(factors):
    believed, (mass, length) = whip(2), factors
    true = replace(believed, mass_kg=mass * believed.mass_kg, length_m=length * believed.length_m)
    safety = BackupFilter(believed, intervals=PayloadIntervals(mass=(0.8, 1.2), length=(0.8, 1.2)))
    assert safety.covers(true)
    worst, _ = attacked(safety, true, Attack("corners", 7, 16))
    assert worst <= 1.0


def test_a_state_does_not_depend_on_its_neighbours():
    beam = whip(4)
    safety = BackupFilter(beam)
    env = DeformTransportVectorEnv(5, beam=beam, autoreset_mode=AutoresetMode.DISABLED)
    observation, _ = env.reset(seed=2)
    layout = env.unwrapped.engine.layout
    layout.part(observation, "swing")[:] = 0.8 * math.pi / 6
    wished = np.tile([-LARGEST, 0.5, 1.0], (5, 1))
    together = safety.certify_action(wished, observation, safety.memory(5))
    for i in range(5):
        alone = safety.certify_action(wished[i : i + 1], observation[i : i + 1], safety.memory(1))
        assert (alone.allowed_m_s2[0] == together.allowed_m_s2[i]).all()
        assert alone.margin[0] == together.margin[i]
    env.close()
