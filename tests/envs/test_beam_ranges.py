"""Episodes draw their beams, and really carry them."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from defmanip_gym.envs.vector import DeformTransportVectorEnv
from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams, BeamRanges, DisturbanceParams
from defmanip_gym.theory.certificates import certify
from defmanip_gym.theory.certificates.conditions import TRANSPORT_CONDITIONS, ParameterIntervals
from defmanip_gym.wrappers.nu_max_scaling import NuMaxVectorActionScaling

ENV_ID = "defmanip_gym:DeformTransport-v0"
RANGES = BeamRanges(damping=(0.05, 1.0), mass_kg=(2.5, 3.7), length_m=(0.5, 0.7))
KEYS = ("beam_damping", "beam_mass_kg", "beam_length_m")


def drawn(info):
    return np.array([info[key] for key in KEYS])


def test_every_episode_draws_a_beam_from_the_ranges_by_its_seed():
    env = DeformTransportVectorEnv(
        16, beam_ranges=RANGES, max_episode_steps=2, autoreset_mode="SameStep"
    )
    first = drawn(env.reset(seed=0)[1])
    for row, ends in zip(first, (RANGES.damping, RANGES.mass_kg, RANGES.length_m), strict=True):
        assert ((row >= ends[0]) & (row <= ends[1])).all()
        assert len(np.unique(row)) == 16
    env.step(np.zeros((16, 3)))
    *_, info = env.step(np.zeros((16, 3)))
    assert (drawn(info) != first).all()
    assert np.array_equal(drawn(info["final_info"]), first)
    assert np.array_equal(drawn(env.reset(seed=0)[1]), first)


@pytest.mark.parametrize("segments", [1, 3])
def test_an_episode_moves_like_an_environment_built_with_its_beam(segments):
    beam = BeamParams(segment_count=segments, root_stiffness=0.3)
    shared = {"nominal_beam": beam, "constraint_mode": "cost"}
    many = DeformTransportVectorEnv(5, beam=beam, beam_ranges=RANGES, **shared)
    observations, info = many.reset(seed=7, options={"start": "paper"})
    actions = np.random.default_rng(0).uniform(-1, 1, (40, 3))
    alone = []
    for damping, mass_kg, length_m in drawn(info).T:
        own = replace(beam, damping=damping, mass_kg=mass_kg, length_m=length_m)
        env = gymnasium.make(ENV_ID, beam=own, **shared)
        observation, _ = env.reset(seed=0, options={"start": "paper"})
        alone.append([observation, *(env.step(action)[0] for action in actions)])
    together = [observations, *(many.step(np.tile(action, (5, 1)))[0] for action in actions)]
    np.testing.assert_allclose(np.swapaxes(together, 0, 1), alone, rtol=1e-9, atol=1e-9)
    assert np.ptp(np.array(alone)[:, -1], axis=0).max() > 0.01


def test_draws_do_not_depend_on_the_batch():
    disturbance = DisturbanceParams(force_sensor_noise_n=0.1, swing_sensor_noise_rad=0.01)
    arguments = {"beam_ranges": RANGES, "disturbance": disturbance, "max_episode_steps": 30}
    many, few = (DeformTransportVectorEnv(count, **arguments) for count in (7, 1))
    many.reset(seed=3)
    few.reset(seed=8)
    for action in np.random.default_rng(1).uniform(-1, 1, (100, 7, 3)):
        (theirs, _, _, _, info), (own, _, _, _, own_info) = many.step(action), few.step(action[5:6])
        assert np.array_equal(theirs[5:6], own)
        assert np.array_equal(drawn(info)[:, 5:6], drawn(own_info))


def test_certificates_apply_only_if_they_cover_every_beam_that_may_be_drawn():
    beam = BeamParams()
    certificate = certify(
        beam,
        sigma_rad=np.pi / 6,
        method="phase_plane",
        conditions=TRANSPORT_CONDITIONS,
        intervals=ParameterIntervals(damping=(0.5, 2.0)),
    )
    for ranges, applies in (
        (BeamRanges(damping=(0.05, 0.2)), True),
        (BeamRanges(damping=(0.01, 0.2)), False),
        (BeamRanges(mass_kg=(2.0, 4.0)), False),
    ):
        env = DeformTransportVectorEnv(2, beam_ranges=ranges)
        _, info = NuMaxVectorActionScaling(env, certificate).reset(seed=0)
        assert info["certificate_applies"].tolist() == [applies] * 2


def test_ranges_that_make_no_beam_are_refused():
    with pytest.raises(ParameterError, match="length_m"):
        gymnasium.make(ENV_ID, beam_ranges=BeamRanges(length_m=(0.01, 0.6)))
    with pytest.raises(ParameterError, match="beam_ranges"):
        gymnasium.make(ENV_ID, beam_ranges={"dampings": (0.1, 1.0)})
