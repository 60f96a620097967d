"""The rig moves the grasp as told and the object answers as Eq. (6b) says."""

import numpy as np
import pytest
from nonlinear_beam import chain_acceleration, largest_swing

from defmanip_gym.params import BeamParams
from defmanip_gym.plant.object_rig import ObjectRig
from defmanip_gym.plant.rig_model import beam_rig

STIFF = dict(root_stiffness=2.0, damping=0.3, joint_stiffness=3.0, joint_damping=0.1)


def shaken(beam, count=1, timestep_s=0.002):
    return ObjectRig(beam_rig(beam, timestep_s=timestep_s), count=count, num_threads=1)


@pytest.mark.parametrize("segments", [1, 3, 8])
def test_accelerations_are_those_of_the_theory(segments):
    beam, rng = BeamParams(segment_count=segments, **STIFF), np.random.default_rng(segments)
    swing, rate = rng.uniform(-0.5, 0.5, (6, segments)), rng.uniform(-2, 2, (6, segments))
    inputs = rng.uniform(-3, 3, (6, 4))
    rig = shaken(beam, 6)
    rig.place(swing, rate)
    expected = chain_acceleration(beam)(swing, rate, inputs[:, 0], inputs[:, 2], inputs[:, 3])
    np.testing.assert_allclose(
        rig.accelerations(inputs), expected, rtol=0, atol=1e-7 * np.abs(expected).max()
    )


def test_a_beam_does_not_feel_leftward_acceleration():
    rig = shaken(BeamParams(segment_count=2))
    assert np.abs(rig.accelerations(np.array([[0.0, 5.0, 0.0, 0.0]]))).max() < 1e-6


def test_shaking_reaches_what_the_integrated_theory_reaches():
    beam = BeamParams(segment_count=2, **STIFF)

    def inputs(t):
        return 0.8 * np.sign(np.sin(5 * t)), 0.3 * np.cos(7 * t), 0.5 * (t > 1)

    def command(t, swing, _):
        forward, upward, yaw_rate = inputs(t)
        return np.tile([forward, 0.0, upward, yaw_rate], (len(swing), 1))

    peak = shaken(beam).shake(command, duration_s=1.6).peak
    expected = largest_swing(
        chain_acceleration(beam),
        lambda t, *_: tuple(np.full(1, value) for value in inputs(t)),
        np.zeros((1, 2)),
        duration_s=1.6,
        period_s=0.002,
    )
    np.testing.assert_allclose(peak, expected, rtol=0.01)


def test_playing_a_recording_gives_the_same_motion():
    rig = shaken(BeamParams(segment_count=3), count=3)
    amplitudes = np.array([0.1, 0.2, 0.3])

    def pumping(_, swing, rate):
        inputs = np.zeros((3, 4))
        inputs[:, 0] = -amplitudes * np.sign(rate[:, 0] + 1e-9)
        inputs[:, 2] = 0.1 * np.sign(swing[:, 0])
        return inputs

    recorded = rig.shake(pumping, duration_s=2.0, hold_steps=4, record=True)
    rig.place()
    played = rig.play(recorded.inputs, record=True)
    np.testing.assert_allclose(played.z2[:, 3::4], recorded.z2, atol=1e-12)
    rig.place()
    scale = np.outer(amplitudes / 0.1, [1, 1, 0, 1]) + [0, 0, 1, 0]
    scaled = rig.play(recorded.inputs[:1], scale=scale)
    np.testing.assert_allclose(scaled.peak[0], played.peak[0], rtol=1e-12)
    assert scaled.peak[2, 0] > 2 * scaled.peak[0, 0]


def test_a_recorded_yaw_rate_is_reached():
    rig = shaken(BeamParams())
    rig.place(np.array([[0.3]]))
    inputs = np.zeros((1, 400, 4))
    inputs[..., 3] = 3.0
    turning = rig.play(inputs, record=True).z2[0, :, 0]
    rig.place(np.array([[0.3]]))
    straight = rig.play(np.zeros((1, 400, 4)), record=True).z2[0, :, 0]
    # a thin rod's restoring torque m g l / 2 sin φ loses m l²/3 ω² sin φ cos φ: slower by the root
    lost = (0.6 / 3 * 3.0**2) / (9.81 / 2) * np.cos(0.2)
    slower = (turning < 0).argmax() / (straight < 0).argmax()
    assert slower == pytest.approx(1 / np.sqrt(1 - lost), rel=0.02)


def test_factors_vary_damping_and_springs_only():
    beam, rig = BeamParams(segment_count=2, **STIFF), beam_rig(BeamParams(segment_count=2, **STIFF))
    scaled = BeamParams(
        segment_count=2, root_stiffness=6.0, damping=0.15, joint_stiffness=9.0, joint_damping=0.05
    )
    varied = ObjectRig(rig.varied(damping=0.5, stiffness=3.0), count=1, num_threads=1)
    swing, rate, inputs = np.array([[0.3, -0.2]]), np.array([[1.0, -1.0]]), np.zeros((1, 4))
    results = []
    for each in (varied, shaken(scaled), shaken(beam)):
        each.place(swing, rate)
        results.append(each.accelerations(inputs))
    np.testing.assert_allclose(results[0], results[1], rtol=1e-9)
    assert np.abs(results[0] - results[2]).max() > 1


def test_divergence_is_told_and_written_nowhere(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)  # where MuJoCo would write its warnings to a file
    beam = BeamParams(segment_count=8, joint_stiffness=1e5, joint_damping=0.0)
    rig = shaken(beam, timestep_s=0.01)
    rig.place(np.linspace(0, 0.1, 8)[None])
    assert rig.play(np.zeros((1, 300, 4))).diverged.all()
    assert not list(tmp_path.iterdir()) and capfd.readouterr().err == ""
