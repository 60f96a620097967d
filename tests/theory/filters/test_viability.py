"""The viable set of one hinge: its bounds, and what they are worth, by independent simulation."""

import math
from functools import cache

import numpy as np
import pytest

from defmanip_gym.errors import CertificateError, ParameterError
from defmanip_gym.params import BeamParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.certificates import TRANSPORT_CONDITIONS, certify
from defmanip_gym.theory.filters.storage_filter import StorageFilter
from defmanip_gym.theory.filters.viability import viable_set
from defmanip_gym.theory.filters.viability_share import certificate_share, storage_share

SIGMA, A_MAX, V_MAX, PERIOD = math.pi / 6, 3.0, 2.0, 0.02
LEVER = 1.5 / 0.6  # first moment over inertia of the reference rod
MOST = 4000  # tests run many states at once


@cache
def made(**changes):
    beam = {name: changes.pop(name) for name in ("damping", "root_stiffness") if name in changes}
    sigma = changes.pop("sigma_rad", SIGMA)
    return viable_set(BeamParams(**beam), sigma_rad=sigma, task=TaskParams(**changes))


def moved(phi, rate, push, damping, steps=20):
    """A period ahead, by many small symplectic steps; and the largest |φ| on the way."""
    h, farthest = PERIOD / steps, np.abs(phi)
    inertia = 3.1153 * 0.6**2 / 3
    for _ in range(steps):
        middle = phi + h / 2 * rate
        pull = LEVER * (9.81 * np.sin(middle) + push * np.cos(middle))
        rate = (rate * (1 - h / 2 * damping / inertia) - h * pull) / (1 + h / 2 * damping / inertia)
        phi = middle + h / 2 * rate
        farthest = np.maximum(farthest, np.abs(phi))
    return phi, rate, farthest


def drawn(count, seed):
    rng = np.random.default_rng(seed)
    return rng, rng.uniform(-SIGMA, SIGMA, count), rng.uniform(-V_MAX, V_MAX, count)


@pytest.mark.parametrize("stiffness", [0.0, 15.0])
def test_without_a_speed_limit_the_edge_is_the_braking_that_grazes_sigma(stiffness):
    viable = made(damping=0.0, root_stiffness=stiffness, max_speed_m_s=1000.0)
    phi = viable.swing
    fallen = 9.81 * (np.cos(phi) - math.cos(SIGMA)) + A_MAX * (math.sin(SIGMA) - np.sin(phi))
    spring = stiffness / (3.1153 * 0.6**2 / 3) * (SIGMA**2 - phi**2)
    closed = np.sqrt(np.maximum(2 * LEVER * fallen + spring, 0.0))
    middle = len(viable.speed) // 2
    assert viable.outer[:, middle] == pytest.approx(closed, rel=1e-6, abs=1e-6)
    # near ±σ a state between samples may be lost that is not with braking to the moment
    assert viable.inner[:, middle] == pytest.approx(closed, abs=0.005)


@pytest.mark.parametrize("damping", [0.0, 0.1, 1.0, 10.0])
def test_bounds_differ_by_less_than_two_thousandths(damping):
    viable = made(damping=damping)
    assert (viable.inner <= viable.outer).all()
    assert 0 < viable.error < 0.002


def test_at_the_speed_limit_only_storage_is_left():
    """Where the grasp can no longer brake the swing, and it is too late to run up."""
    viable = made(damping=0.0)
    last = np.flatnonzero(viable.swing >= 0.1)
    left = np.sqrt(2 * LEVER * 9.81 * (np.cos(viable.swing[last]) - math.cos(SIGMA)))
    assert viable.outer[last, -1] == pytest.approx(left, abs=0.02)
    assert viable.inner[last, -1] == pytest.approx(left, abs=0.02)


@pytest.mark.parametrize("name", ["max_acceleration_m_s2", "max_speed_m_s", "sigma_rad", "damping"])
def test_more_of_anything_makes_it_larger(name):
    ends = {
        "max_acceleration_m_s2": (1.0, 2.0, 4.0),
        "max_speed_m_s": (0.5, 1.0, 2.0),
        "sigma_rad": (0.3, 0.5, 0.8),
        "damping": (0.0, 0.1, 1.0),
    }[name]
    volumes = [made(**{name: value}).volume for value in ends]
    # room for speed counts as volume, so compare what each speed has
    scale = ends if name == "max_speed_m_s" else (1.0, 1.0, 1.0)
    per_speed = [(v.low / s, v.high / s) for v, s in zip(volumes, scale, strict=True)]
    assert per_speed[0][1] < per_speed[1][0] and per_speed[1][1] < per_speed[2][0]


@pytest.mark.parametrize("reserved", [True, False])
def test_storages_set_lies_inside(reserved):
    viable, barrier = made(), StorageFilter()
    level = barrier.pass_j * (barrier.level_share if reserved else 1.0)
    _, phi, speed = drawn(MOST, 0)
    inertia = 3.1153 * 0.6**2 / 3
    kinetic = level - inertia * LEVER * 9.81 * (1 - np.cos(phi))
    inside = kinetic >= 0
    rate = np.sqrt(2 * np.maximum(kinetic, 0.0) / inertia)[inside]
    assert inside.sum() > 1000
    for sign in (-1, 1):
        assert viable.contains(phi[inside], sign * 0.999 * rate, speed[inside]).all()


@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_a_driver_who_pumps_as_far_as_the_set_allows_stays_in_it(damping):
    viable = made(damping=damping)
    rng, phi, speed = drawn(300, 1)
    rate = rng.uniform(-5, 5, 300)
    inside = viable.margin(phi, rate, speed) > 0.01
    phi, rate, speed = phi[inside], rate[inside], speed[inside]
    assert len(phi) > 100
    for _ in range(150):
        low = np.maximum(-A_MAX, (-V_MAX - speed) / PERIOD)
        high = np.minimum(A_MAX, (V_MAX - speed) / PERIOD)
        pushes = np.linspace(low, high, 13)
        swings, rates, farthest = moved(phi, rate, pushes, damping)
        margins = viable.margin(swings, rates, np.clip(speed + PERIOD * pushes, -V_MAX, V_MAX))
        margins[farthest > SIGMA] = -np.inf
        # the least margin that is one, or the best there is
        chosen = np.where(margins >= 0.01, -margins, margins - 100.0).argmax(axis=0)
        picked = chosen, np.arange(len(phi))
        phi, rate = swings[picked], rates[picked]
        speed = np.clip(speed + PERIOD * pushes[picked], -V_MAX, V_MAX)
        assert (margins[picked] >= 0.0).all()


def test_from_just_outside_no_policy_of_a_search_comes_to_rest_within_sigma():
    viable = made()
    rng, phi, speed = drawn(MOST, 2)
    rate = np.zeros(MOST) + viable.margin(phi, 0.0, speed)
    rate *= 1.01
    assert viable.excludes(phi, rate, speed).mean() > 0.98
    chosen = viable.excludes(phi, rate, speed)
    phi, rate, speed = phi[chosen], rate[chosen], speed[chosen]
    switch, first = rng.uniform(0, 0.5, len(phi)), rng.choice((-1.0, 1.0), len(phi))
    constant = np.arange(len(phi)) % 2 == 0
    held = rng.uniform(-A_MAX, A_MAX, len(phi))
    lost, done = np.zeros(len(phi), bool), np.zeros(len(phi), bool)
    for k in range(80):
        # half of them constant, half bang-bang, of which the best one is among the draws
        bang = A_MAX * np.where(k * PERIOD < switch, -np.abs(first), np.abs(first))
        push = np.where(constant, held, bang)
        low, high = (-V_MAX - speed) / PERIOD, (V_MAX - speed) / PERIOD
        push = np.clip(push, np.maximum(low, -A_MAX), np.minimum(high, A_MAX))
        later, later_rate, farthest = moved(phi, rate, push, 0.1)
        lost |= ~done & (farthest > SIGMA)
        done |= ~lost & (later_rate <= 0)
        phi, rate, speed = later, later_rate, speed + PERIOD * push
    assert lost.all()


def test_states_are_told_apart_by_speed_and_mirrored():
    viable = made()
    assert viable.contains(SIGMA, 0.0, 1.0) and viable.contains(0.0, 3.6, -2.0)
    assert viable.excludes(0.0, 3.6, 1.9) and viable.excludes(0.0, -3.6, -1.9)
    assert not viable.contains(0.0, 0.0, 2.1) and not viable.contains(1.01 * SIGMA, 0.0, 0.0)


def test_its_area_is_that_of_the_energy_where_nothing_may_be_accelerated():
    """With hardly any acceleration the set is {V ≤ V_σ}, at every speed."""
    viable = made(damping=0.0, max_acceleration_m_s2=0.001)
    phi = -SIGMA * np.cos(np.linspace(0, math.pi, 20001))
    rate = np.sqrt(np.maximum(2 * LEVER * 9.81 * (np.cos(phi) - math.cos(SIGMA)), 0.0))
    area = 2 * np.trapezoid(rate, phi)
    assert viable.area(0.7) == pytest.approx((area, area), rel=1e-3)
    assert viable.volume == pytest.approx((4 * area, 4 * area), rel=1e-3)
    assert storage_share(viable, StorageFilter(), reserved=False) == pytest.approx((1, 1), rel=1e-3)


def test_shares_order_storage_far_above_what_is_blind_to_the_state():
    viable, barrier = made(damping=1.0), StorageFilter(BeamParams(damping=1.0))
    certificate = certify(viable.beam, method="phase_plane")
    kept = storage_share(viable, barrier)
    whole = storage_share(viable, barrier, reserved=False)
    blind = certificate_share(viable, certificate)
    assert 0 < kept.low < kept.high < whole.low < whole.high < 1
    assert blind.low == pytest.approx(blind.high, rel=0.002)
    transport = certify(viable.beam, method="phase_plane", conditions=TRANSPORT_CONDITIONS)
    assert transport.nu_max < certificate.nu_max
    assert blind.high < 1


def test_what_is_for_another_object_or_sigma_is_refused():
    viable = made()
    with pytest.raises(CertificateError, match="viable set"):
        storage_share(viable, StorageFilter(sigma_rad=0.4))
    with pytest.raises(CertificateError, match="viable set"):
        storage_share(viable, StorageFilter(BeamParams(length_m=0.7)))
    with pytest.raises(CertificateError, match="viable set"):
        certificate_share(viable, certify(BeamParams(damping=1.0), sigma_rad=0.4))


def test_what_has_no_grid_is_refused():
    with pytest.raises(CertificateError, match="segment_count"):
        viable_set(BeamParams(segment_count=2))
    with pytest.raises(ParameterError, match="control_period_s"):
        viable_set(task=TaskParams(control_period_s=0.001, physics_period_s=0.001))
    with pytest.raises(ParameterError, match="control_period_s"):
        viable_set(BeamParams(damping=9000.0))
    with pytest.raises(ParameterError, match="sigma_rad"):
        viable_set(sigma_rad=2.0)
