"""Elastic beams of rigid segments against Euler–Bernoulli."""

import numpy as np
import pytest
from scipy.linalg import eigh

from defmanip_gym.errors import ParameterError
from defmanip_gym.theory.payload.elastic_beam import elastic_beam, first_elastic_frequency
from defmanip_gym.theory.payload.zero_dynamics import is_hurwitz, linearize

# (βL) of the first three elastic modes
WAVE_NUMBERS = {
    "clamped": np.array([1.8751040687, 4.6940911330, 7.8547574382]),
    "pinned": np.array([3.9266023120, 7.0685827456, 10.2101761228]),
}
BEAM = dict(length_m=2.0, mass_kg=1.0, bending_stiffness_n_m2=3.0, radius_m=0.005)


def elastic_modes(beam):
    """Return frequencies and shapes without gravity, without a pinned beam's rigid swing."""
    linear = linearize(beam)
    squares, modes = eigh(linear.k_o22, linear.m_o22)
    rigid = 0 if beam.root_stiffness > 0 else 1
    return np.sqrt(squares[rigid:]), modes[:, rigid:]


def errors(root, segment_count):
    beam = elastic_beam(**BEAM, damping_ratio=0.0, segment_count=segment_count, root=root)
    exact = WAVE_NUMBERS[root] ** 2 * np.sqrt(3.0 / (1.0 * 2.0**3))
    return np.abs(elastic_modes(beam)[0][:3] / exact - 1)


@pytest.mark.parametrize(("root", "order"), [("clamped", 2), ("pinned", 4)])
def test_first_three_frequencies_converge_to_euler_bernoulli(root, order):
    coarse, fine = errors(root, 16), errors(root, 32)
    np.testing.assert_allclose(np.log2(coarse / fine), order, atol=0.2)
    assert fine.max() < 3e-3


def test_the_formula_for_the_first_frequency_is_euler_bernoullis():
    for root, wave_numbers in WAVE_NUMBERS.items():
        frequency = first_elastic_frequency(
            length_m=2.0, mass_kg=1.0, bending_stiffness_n_m2=3.0, root=root
        )
        assert frequency == pytest.approx(wave_numbers[0] ** 2 * np.sqrt(3.0 / 8.0), rel=1e-9)


@pytest.mark.parametrize("root", ["clamped", "pinned"])
def test_first_elastic_mode_has_the_damping_ratio_asked_for(root):
    beam = elastic_beam(**BEAM, damping_ratio=0.05, segment_count=24, root=root, damping=0.0)
    frequencies, modes = elastic_modes(beam)
    ratio = modes[:, 0] @ linearize(beam).d_o22 @ modes[:, 0] / (2 * frequencies[0])
    assert ratio == pytest.approx(0.05, rel=2e-3)


def test_a_pinned_beam_swings_with_the_same_ratio_unless_told_otherwise():
    beam = elastic_beam(**BEAM, damping_ratio=0.1, segment_count=8, root="pinned")
    linear = linearize(beam)
    rigid = np.ones(8)
    inertia = rigid @ linear.m_o22 @ rigid
    frequency = np.sqrt(rigid @ linear.gravity_stiffness @ rigid / inertia)
    swing = rigid @ linear.d_o22 @ rigid / (2 * inertia * frequency)
    assert swing == pytest.approx(0.1, rel=1e-2)
    assert is_hurwitz(linear.A_u)
    undamped = elastic_beam(**BEAM, damping_ratio=0.1, segment_count=8, root="pinned", damping=0.0)
    assert undamped.damping == 0.0


def test_density_gives_the_mass_of_a_round_beam():
    given = {key: value for key, value in BEAM.items() if key != "mass_kg"}
    beam = elastic_beam(**given, density_kg_m3=1000.0, damping_ratio=0.1, segment_count=3)
    assert beam.mass_kg == pytest.approx(1000.0 * np.pi * 0.005**2 * 2.0)


@pytest.mark.parametrize(
    "changes",
    [
        {"mass_kg": None},
        {"density_kg_m3": 1000.0},
        {"bending_stiffness_n_m2": 0.0},
        {"damping_ratio": -0.1},
        {"root": "free"},
        {"root": "pinned", "segment_count": 1},
        {"damping": -1.0},
    ],
)
def test_beams_that_do_not_exist_are_refused(changes):
    with pytest.raises(ParameterError):
        elastic_beam(**{**BEAM, "damping_ratio": 0.1, "segment_count": 4, **changes})
