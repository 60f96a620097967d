"""Adversaries on the MuJoCo plant: no certificate breaks, and none has much room to spare."""

import math
from dataclasses import replace
from functools import cache
from importlib.resources import files

import numpy as np
import pytest

from defmanip_gym.attack.adjoint import Adjoint
from defmanip_gym.attack.certificate import admissible, attack_certificate, plants_within
from defmanip_gym.attack.crossing import smallest_crossing
from defmanip_gym.attack.search import attack
from defmanip_gym.attack.switching import worst_switching
from defmanip_gym.attack.target import InputLimits, PlantFactors, beam_target, mjcf_target
from defmanip_gym.errors import ParameterError
from defmanip_gym.objects.mjcf_object import mjcf_object
from defmanip_gym.params import BeamParams
from defmanip_gym.plant.object_rig import ObjectRig
from defmanip_gym.theory.certificates import (
    TRANSPORT_CONDITIONS,
    CertificateConditions,
    ParameterIntervals,
    certify,
)
from defmanip_gym.theory.certificates.peak_bounds import l1_bound
from defmanip_gym.theory.payload.elastic_beam import elastic_beam
from defmanip_gym.theory.payload.zero_dynamics import linearize

SIGMA = math.pi / 6


def elastic(root, damping_ratio):
    return elastic_beam(
        length_m=0.6,
        mass_kg=1.0,
        bending_stiffness_n_m2=0.2,
        damping_ratio=damping_ratio,
        segment_count=8,
        root=root,
        radius_m=0.01,
    )


# beam, longest attack s, steps of ascent: where one light mode dominates, feedback is enough
BEAMS = {
    "one hinge, light": (BeamParams(damping=0.1), 30.0, 0),
    "one hinge, heavy": (BeamParams(damping=1.0), 30.0, 2),
    "three, light": (BeamParams(segment_count=3, joint_stiffness=3.0, damping=0.05), 30.0, 0),
    "three, heavy": (BeamParams(segment_count=3, joint_stiffness=3.0, damping=0.5), 30.0, 2),
    "eight clamped, light": (elastic("clamped", 0.02), 30.0, 0),
    "eight clamped, heavy": (elastic("clamped", 0.3), 3.0, 2),
    "eight pinned, light": (elastic("pinned", 0.02), 26.0, 0),
    "eight pinned, heavy": (elastic("pinned", 0.3), 3.0, 2),
}


@cache
def attacked(name):
    beam, longest_s, iterations = BEAMS[name]
    target = beam_target(beam)
    bound = SIGMA / l1_bound(target.linear)[: target.linear.count].max()
    return target, attack(
        target,
        InputLimits(forward_m_s2=float(bound)),
        sigma=SIGMA,
        longest_s=longest_s,
        iterations=iterations,
        num_threads=1,
    )


@pytest.mark.parametrize("name", BEAMS)
def test_no_attack_breaks_the_l1_bound(name):
    _, result = attacked(name)
    assert not result.is_broken
    assert result.violating_bound > result.certified_bound


@pytest.mark.parametrize("name", BEAMS)
def test_a_slightly_larger_bound_breaks(name):
    target, result = attacked(name)
    assert result.tightness >= (0.9 if target.linear.count == 1 else 0.8)
    # played once more, on a plant of its own
    rig = ObjectRig(target.rig, count=1, num_threads=1)
    rig.place(*result.start.reshape(1, 2, -1).swapaxes(0, 1))
    assert np.abs(result.inputs[:, 0]).max() <= 1.25 * result.certified_bound
    shaking = rig.play(result.inputs[None])
    assert shaking.peak.max() > SIGMA and not shaking.diverged.any()


@pytest.mark.parametrize("segments", [1, 3])
def test_gradients_are_those_of_the_plant(segments):
    beam = BeamParams(segment_count=segments, joint_stiffness=3.0, damping=0.3, joint_damping=0.05)
    target = beam_target(beam, timestep_s=0.005)
    rng = np.random.default_rng(segments)
    inputs = rng.uniform(-1, 1, (200, 4))
    inputs[:, 1] = 0.0
    inputs[:, 3] = 0.8
    start = rng.uniform(-0.3, 0.3, 2 * segments)
    gradient, by_start = Adjoint(target.rig, stride=1).gradient(
        inputs, start, coordinate=segments - 1, turning_rad_s=0.8
    )
    rig = ObjectRig(target.rig, count=2, num_threads=1)

    def difference(inputs_change, start_change):
        pair = np.stack((inputs + inputs_change, inputs - inputs_change))
        starts = np.stack((start + start_change, start - start_change))
        rig.place(starts[:, :segments], starts[:, segments:])
        reached = rig.play(pair, record=True).z2[:, -1, segments - 1]
        return (reached[0] - reached[1]) / 2

    pushes = 1e-2 * rng.choice([-1.0, 1.0], (200, 4)) * [1, 0, 1, 0]
    assert difference(pushes, 0.0) == pytest.approx((gradient * pushes).sum(), rel=0.02)
    moves = 1e-3 * rng.choice([-1.0, 1.0], 2 * segments)
    assert difference(0.0, moves) == pytest.approx(by_start @ moves, rel=0.02)


def test_linear_switching_reaches_the_l1_bound_where_the_object_is_linear():
    target = beam_target(BeamParams(segment_count=2, joint_stiffness=3.0, damping=1.0))
    bound = 0.01 / l1_bound(target.linear)[1]
    shares, _ = worst_switching(
        target.linear,
        coordinate=1,
        steps=round(8.0 / target.timestep_s),
        timestep_s=target.timestep_s,
    )
    rig = ObjectRig(target.rig, count=1, num_threads=1)
    peak = rig.play(shares[None] * [bound, 0, 0, 0]).peak[0, 1]
    assert 0.98 * 0.01 < peak < 0.01


@pytest.mark.parametrize(
    ("beam", "least_tightness"),
    [
        (BeamParams(damping=1.0), 0.8),
        (BeamParams(damping=0.3, segment_count=3, joint_stiffness=3.0), 0.7),
    ],
)
def test_lifting_turning_and_swinging_starts_do_not_break_the_transport_certificate(
    beam, least_tightness
):
    certificate = certify(beam, conditions=TRANSPORT_CONDITIONS)
    result = attack_certificate(certificate, longest_s=8.0, iterations=1, num_threads=1)
    assert not result.is_broken
    assert result.tightness > least_tightness
    assert np.abs(result.inputs[:, 2]).max() == pytest.approx(0.05)
    assert set(np.round(result.inputs[:, 3], 6)) == {0.0, 0.3}


def test_lifting_turning_and_swinging_starts_make_attacks_worse():
    target = beam_target(BeamParams(damping=1.0))
    limits = InputLimits(forward_m_s2=1.8, up_m_s2=0.3, yaw_rate_rad_s=0.5, start=0.05)
    peaks = [
        attack(target, each, sigma=SIGMA, num_threads=1).peak_at_bound
        for each in (InputLimits(forward_m_s2=1.8), limits)
    ]
    assert peaks[1] > 1.02 * peaks[0]


def test_the_worst_plant_within_the_intervals_is_found():
    beam = BeamParams(damping=1.0, root_stiffness=2.0)
    intervals = ParameterIntervals(damping=(0.5, 2.0), stiffness=(0.9, 1.0))
    certificate = certify(beam, intervals=intervals)
    plants = (PlantFactors(), PlantFactors(damping=0.5, stiffness=0.9))
    assert plants[1] in plants_within(certificate)
    result = attack_certificate(certificate, plant_parameters=plants, longest_s=6.0, num_threads=1)
    assert result.plant == PlantFactors(damping=0.5, stiffness=0.9)
    assert not result.is_broken and result.tightness > 0.85
    # the certificate for the nominal values alone does not cover it
    careless = certify(beam)
    result = attack_certificate(
        careless,
        plant_parameters=[PlantFactors(damping=0.5)],
        longest_s=6.0,
        num_threads=1,
    )
    assert result.is_broken and result.tightness > 1.5


def test_an_object_from_a_file_survives_its_certificate():
    hose = files("defmanip_gym.objects") / "examples" / "hose.xml"
    thing = mjcf_object(str(hose), grasp_site="grasp")
    certificate = certify(thing.linear)
    with pytest.raises(ParameterError, match="mjcf_target"):
        attack_certificate(certificate)
    result = attack_certificate(
        certificate, target=mjcf_target(thing), longest_s=15.0, iterations=1, num_threads=1
    )
    assert not result.is_broken
    assert result.peak_at_bound > 0.6 * SIGMA
    assert result.coordinate in certificate.deformable.coordinates


def test_an_attack_breaks_the_linear_bound_where_the_object_is_not_nearly_linear(tmp_path):
    # held out horizontally by a spring: forward acceleration does nothing at equilibrium, to first
    # order, and a lot beside it
    path = tmp_path / "arm.xml"
    path.write_text(
        """<mujoco><compiler angle="radian"/><worldbody><body name="grip"><site name="grasp"/>
        <geom size="0.05" mass="0.5"/><body>
        <joint name="droop" axis="0 -1 0" stiffness="15" damping="0.1"/>
        <inertial pos="0.1998 0 0.0158" mass="1" diaginertia="0.02 0.02 0.002"/>
        </body></body></worldbody></mujoco>"""
    )
    thing = mjcf_object(path, grasp_site="grasp")
    room = SIGMA - abs(thing.linear.equilibrium[0])
    linear_bound = room / l1_bound(thing.linear)[0]
    result = attack(
        mjcf_target(thing),
        InputLimits(forward_m_s2=float(linear_bound)),
        sigma=SIGMA,
        longest_s=10.0,
        num_threads=1,
    )
    assert result.is_broken and result.tightness > 1.0


def test_a_slowly_swinging_upper_segment_breaks_the_linear_bound_but_not_the_proven_one():
    beam = BeamParams(
        segment_count=2,
        mass_kg=7.6,
        length_m=0.2,
        damping=2.4,
        joint_stiffness=0.016,
        joint_damping=0.004,
    )
    certificate = certify(beam, sigma_rad=0.8)
    target = beam_target(beam, timestep_s=0.004)
    short = {"target": target, "longest_s": 5.0, "iterations": 1, "num_threads": 1}
    broken = attack_certificate(certificate, **short)
    assert broken.is_broken and broken.tightness > 1.0
    assert broken.withstood_bound < broken.violating_bound < broken.certified_bound
    proven = certificate.proven()
    assert proven.proof == "nonlinear" and certificate.proof == "linear"
    assert not attack_certificate(proven, **short).is_broken


def test_an_attack_that_smaller_inputs_win_has_broken_the_certificate_too():
    _, result = attacked("one hinge, heavy")
    assert replace(result, violating_bound=0.99 * result.certified_bound).is_broken


def test_admissible_inputs_are_those_of_the_certificate():
    conditions = CertificateConditions(
        vertical_acceleration_m_s2=0.05,
        yaw_rate_rad_s=0.2,
        initial_swing_rad=0.03,
        acceleration_error_m_s2=0.01,
    )
    beam = BeamParams(damping=1.0)
    certificate = certify(beam, conditions=conditions)
    limits = admissible(certificate, beam_target(beam))
    assert limits.forward_m_s2 == pytest.approx(certificate.acceleration_bound + 0.01)
    np.testing.assert_allclose(limits.inputs[1:], [0.0, 0.05, 0.2])
    assert (limits.start, limits.start_rate) == (0.03, 0.0)
    assert limits.scaled(2.0).up_m_s2 == 0.05


@pytest.mark.parametrize(("guess", "exact"), [(1.0, 1.0123), (1.0, 3.7), (1.0, 0.31), (5.0, 1.0)])
def test_crossings_are_found_from_any_guess(guess, exact):
    found = smallest_crossing(lambda factors: factors**1.5, exact**1.5, guess=guess, count=8)
    assert exact < found <= exact * 1.005
    never = smallest_crossing(lambda factors: factors * 0, 1.0, guess=guess, count=8)
    assert math.isinf(never)


def test_linearization_and_rig_must_be_of_the_same_object():
    one, two = beam_target(BeamParams()), linearize(BeamParams(segment_count=2))
    with pytest.raises(ParameterError, match="number of coordinates"):
        type(one)(linear=two, rig=one.rig)
