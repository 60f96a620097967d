"""The storage filter for objects in the environment: it applies, keeps σ, and bears an attack."""

from pathlib import Path

import numpy as np
import pytest

import defmanip_gym.objects
from defmanip_gym.baselines.analytic.field import make_controller
from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.errors import CertificateError
from defmanip_gym.payloads.mjcf import MjcfPayload
from defmanip_gym.theory.filters.object_filter import ObjectStorageFilter
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.wrappers.filter_for import filter_for, payload_filter_for
from defmanip_gym.wrappers.safety_filter import SafetyFilterVectorWrapper

EXAMPLES = Path(defmanip_gym.objects.__file__).parent / "examples"


def filtered(count, payload=None):
    env = DeformTransportVectorEnv(
        count,
        payload=payload,
        inner_loop="measured_force",
        constraint_mode="cost",
        num_threads=1,
        autoreset_mode="Disabled",
    )
    return SafetyFilterVectorWrapper(env, payload_filter_for(env.config))


@pytest.fixture(scope="module")
def bucket():
    return filtered(16, MjcfPayload(path=str(EXAMPLES / "bucket.xml")))


def largest(env):
    return np.abs(env.unwrapped.engine.plant_state.swing).max(axis=1)


def test_the_paper_task_is_done_inside_it(bucket):
    controller, state = make_controller(bucket.unwrapped.config), None
    observation, info = bucket.reset(seed=0)
    assert info["filter_applies"].all()
    arrived, peak = np.zeros(16, dtype=bool), np.zeros(16)
    for _ in range(500):
        action, state = controller.predict(observation, state)
        observation, _, _, _, info = bucket.step(action)
        peak = np.maximum(peak, np.where(arrived, 0.0, largest(bucket)))
        arrived |= info["is_success"]
    assert arrived.all() and (peak <= bucket.unwrapped.config.sigma_rad).all()


@pytest.mark.parametrize("seed", [1, 2])
def test_an_attacker_that_pushes_with_the_swing_does_not_get_beyond_sigma(bucket, seed):
    rng, layout = np.random.default_rng(seed), bucket.unwrapped.engine.layout
    observation, info = bucket.reset(seed=seed)
    peak = np.zeros(16)
    for _ in range(200):
        rate = layout.part(observation, "swing_rate")[:, 1]
        action = np.stack(
            (-np.sign(rate), rng.uniform(-1, 1, 16), rng.choice((-1.0, 1.0), 16)), axis=1
        )
        observation, _, _, _, info = bucket.step(action)
        running = info["filter_applies"]
        peak = np.maximum(peak, np.where(running, largest(bucket), 0.0))
    sigma_rad = bucket.unwrapped.config.sigma_rad
    assert 0.5 * sigma_rad < peak.max() <= sigma_rad


def test_another_objects_filter_does_not_apply(bucket):
    hose = MjcfPayload(path=str(EXAMPLES / "hose.xml"))
    with pytest.raises(CertificateError, match="segment_count"):
        SafetyFilterVectorWrapper(filtered(1).env, ObjectStorageFilter(hose.linkage, mass_kg=1.3))
    heavier = bucket.filtering._filter.linkage
    heavier = heavier._replace(mass=1.1 * heavier.mass)
    made = ObjectStorageFilter(heavier, mass_kg=2.6)
    _, info = SafetyFilterVectorWrapper(bucket.env, made).reset(seed=0)
    assert not info["filter_applies"].any() and "not computed" in info["filter_reason"][0]


def test_rods_get_the_rods_filter():
    config = filtered(1).unwrapped.config
    made = payload_filter_for(config)
    assert isinstance(made, StorageFilter) and made == filter_for(config)


def test_a_filter_that_believes_another_mass_does_not_apply(bucket):
    payload = bucket.unwrapped.config.payload
    made = ObjectStorageFilter(payload.linkage, mass_kg=2 * payload.mass_kg)
    _, info = SafetyFilterVectorWrapper(bucket.env, made).reset(seed=0)
    assert not info["filter_applies"].any()
