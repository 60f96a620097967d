import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from mujoco import batch

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.plant import names
from defmanip_gym.plant.beam_variation import BeamVariation
from defmanip_gym.plant.builder import build_model
from defmanip_gym.plant.rod_body import RodBody

CHANGES = [
    {"damping": 0.0},
    {"damping": 0.7},
    {"mass_kg": 1.3},
    {"length_m": 0.93},
    {"length_m": 0.41},
    {"damping": 0.31, "mass_kg": 5.7, "length_m": 0.77},
]


def batch_of(beam, count=1):
    model = build_model(
        RobotParams(), RodBody(beam), goal_position_m=(0, 0, 1), physics_period_s=0.005
    )
    return batch.Batch(model, count, nthread=1)


def trajectory(plant, steps=40, begin=None):
    """Return (steps, n, ...): positions, velocities and grasp force, from the same start."""
    force = plant.bind("sensordata")  # bound after a step it would lack that step's values
    plant.reset(stage=mujoco.mjtStage.mjSTAGE_NONE.value)
    plant.qpos[:, 3:5] = 1.3, -1.1
    plant.qpos[:, 5:] = 0.3 / (plant.qpos.shape[1] - 5)
    plant.qvel[:, 2] = 0.5
    states = []
    for k in range(steps):
        if begin and k == steps // 2:
            begin()
        plant.ctrl[:, :4] = np.array([30.0, 4.0, 75.0, 30.0]) * math.cos(0.1 * k)
        plant.step(nstep=4, stage=mujoco.mjtStage.mjSTAGE_ACC.value)
        states.append(np.concatenate((plant.qpos, plant.qvel, force), axis=1))
    assert not plant.warning[..., 1].any()
    return np.array(states)


@pytest.mark.parametrize("segments", [1, 4])
def test_simulation_moves_like_a_model_compiled_with_its_beam(segments):
    base = BeamParams(segment_count=segments)
    beams = [replace(base, **change) for change in CHANGES]
    plant = batch_of(base, len(beams))
    BeamVariation(plant, base).set(np.arange(len(beams)), beams)
    together, unchanged = trajectory(plant), trajectory(batch_of(base))[:, 0]
    for index, beam in enumerate(beams):
        np.testing.assert_array_equal(together[:, index], trajectory(batch_of(beam))[:, 0])
        difference = np.abs(together[:, index] - unchanged).max(axis=0)
        assert difference[5] > 1e-3  # swing
        assert difference[-3:].max() > 0.05  # grasp force


@pytest.mark.parametrize("segments", [1, 4])
def test_model_of_a_simulation_is_the_one_compiled_with_its_beam(segments):
    base = BeamParams(segment_count=segments)
    beam, plant = replace(base, **CHANGES[-1]), batch_of(base, 2)
    BeamVariation(plant, base).set(np.array([1]), [beam])
    for index, expected in enumerate((base, beam)):
        model, compiled = plant.get_model(index), batch_of(expected).model
        for field in batch.MODEL_FIELDS:
            if not field.startswith("opt."):
                ours, theirs = getattr(model, field), getattr(compiled, field)
                np.testing.assert_array_equal(ours, theirs, err_msg=field)


@pytest.mark.parametrize("segments", [1, 4])
def test_drawn_beam_has_the_new_length(segments):
    base = BeamParams(segment_count=segments)
    plant = batch_of(base, 2)
    BeamVariation(plant, base).set(np.array([0]), [replace(base, length_m=1.2)])
    model = plant.get_model(0)
    geom = model.geom(names.segment_geom(segments - 1))
    above = sum(model.body(names.segment(index)).pos[2] for index in range(1, segments))
    assert above + geom.pos[2] - geom.size[1] == pytest.approx(-1.2)
    assert geom.pos[2] + geom.size[1] == pytest.approx(0.0)


def test_other_simulations_stay_as_they_are():
    base = BeamParams(segment_count=2)
    untouched, plant = trajectory(batch_of(base, 5)), batch_of(base, 5)
    variation, beams = BeamVariation(plant, base), [replace(base, **c) for c in CHANGES]
    variation.set(np.array([1]), [beams[3]])
    states = trajectory(plant, begin=lambda: variation.set(np.array([2, 4]), beams[4:6]))
    np.testing.assert_array_equal(states[:, [0, 3]], untouched[:, [0, 3]])
    np.testing.assert_array_equal(states[:20, [2, 4]], untouched[:20, [2, 4]])
    np.testing.assert_array_equal(states[:, 1], trajectory(batch_of(beams[3]))[:, 0])
    assert (states[20:, [2, 4]] != untouched[20:, [2, 4]]).any(axis=(0, 2)).all()


@pytest.mark.parametrize("segments", [1, 4])
def test_setting_back_gives_the_first_trajectories(segments):
    base = BeamParams(segment_count=segments)
    plant, ids = batch_of(base, 3), np.arange(3)
    first, variation = trajectory(plant), BeamVariation(plant, base)
    # by the same object, or by another that did not make the fields per-simulation
    for back in (variation, BeamVariation(plant, base)):
        variation.set(ids, [replace(base, **change) for change in CHANGES[-3:]])
        assert (trajectory(plant) != first).any(axis=(0, 2)).all()
        back.set(ids, [base] * 3)
        np.testing.assert_array_equal(trajectory(plant), first)


def expanded(plant):
    return {field for field in batch.MODEL_FIELDS if plant.expanded(field) is not None}


def test_only_fields_that_differ_become_per_simulation():
    base = BeamParams(segment_count=2)
    plant = batch_of(base, 2)
    variation, ids = BeamVariation(plant, base), np.arange(2)
    variation.set(ids, [base, base])
    assert expanded(plant) == set()
    variation.set(ids, [base, replace(base, damping=0.4)])
    assert expanded(plant) == {"tendon_damping"}
    variation.set(ids, [base, replace(base, mass_kg=2.0)])
    assert {"body_mass", "body_inertia"} < expanded(plant)
    assert not {"body_ipos", "body_pos", "geom_size"} & expanded(plant)


@pytest.mark.parametrize(
    "change",
    [
        {"segment_count": 3},
        {"joint_stiffness": 21.0},
        {"joint_damping": 0.3},
        {"root_stiffness": 1.0},
        {"radius_m": 0.01},
    ],
)
def test_beam_of_another_make_is_refused_and_changes_nothing(change):
    base = BeamParams(segment_count=2)
    plant = batch_of(base, 2)
    beams = [replace(base, mass_kg=2.0), replace(base, **change)]
    with pytest.raises(ParameterError, match="beams"):
        BeamVariation(plant, base).set(np.arange(2), beams)
    assert expanded(plant) == set()


@pytest.mark.parametrize(
    ("ids", "count", "name"),
    [
        ([1, 0], 2, "ids"),
        ([1, 1], 2, "ids"),
        ([-1, 1], 2, "ids"),
        ([1, 3], 2, "ids"),
        ([0, 1], 1, "beams"),
        ([0, 1], 3, "beams"),
    ],
)
def test_ids_and_beams_that_do_not_fit_are_refused(ids, count, name):
    base = BeamParams()
    plant = batch_of(base, 3)
    with pytest.raises(ParameterError) as caught:
        BeamVariation(plant, base).set(np.array(ids), [replace(base, mass_kg=2.0)] * count)
    assert caught.value.name == name
    assert expanded(plant) == set()


def test_no_simulations_are_no_error():
    plant = batch_of(BeamParams(), 2)
    BeamVariation(plant, BeamParams()).set(np.array([], dtype=np.intp), [])
    assert expanded(plant) == set()
