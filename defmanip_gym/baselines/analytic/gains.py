"""The paper's controller for another object than the reference beam: gains found for it."""

from __future__ import annotations

from dataclasses import replace

from defmanip_gym.baselines.analytic.tanner_loop import tanner_loop
from defmanip_gym.baselines.analytic.tanner_params import TannerParams
from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.task_params import TaskParams
from defmanip_gym.theory.control.gain_search import loop_with_margin, slowest_swing
from defmanip_gym.validation import require_params, require_range


def gains_for(
    beam: BeamParams,
    *,
    robot: RobotParams | None = None,
    task: TaskParams | None = None,
    params: TannerParams | None = None,
    margin: float = 0.5,
    damping_factors: tuple[float, float] = (0.8, 1.25),
) -> TannerParams:
    """Return ``params`` with gains whose sampled loop has a margin with this beam.

    The environment's linearization is taken to count on no damping at the root, as its default
    does. With many segments the force loop grows weak unless the damping is known well:
    ``damping_factors`` says how well. The damping that the force law assumes is carried over as
    what it adds to the slowest swing of the reference beam.

    Args:
        beam: the object.
        robot: that carries it.
        task: goal and control period.
        params: whose gains are wished for, and whose other choices stay.
        margin: least disk margin, in (0, 2); 0.5 bears 0.6 to 1.67 times the gain, or 28° of phase.
        damping_factors: between which multiples of the beam's damping at the root the true one is.

    Raises:
        GainError: no gains have the margin; it says what limits it.
        ParameterError: arguments out of range.
    """
    beam = require_params("beam", beam, BeamParams)
    robot = RobotParams() if robot is None else require_params("robot", robot, RobotParams)
    task = TaskParams() if task is None else require_params("task", task, TaskParams)
    params = TannerParams() if params is None else require_params("params", params, TannerParams)
    factors = require_range("damping_factors", damping_factors, 0.0, 1e3)
    reference = BeamParams()
    per_damping, _, _ = slowest_swing(reference)
    found = loop_with_margin(
        tanner_loop(
            params,
            beam=beam,
            linearization_beam=replace(beam, damping=0.0),
            robot=robot,
            task=task,
        ),
        added_ratio=max(per_damping * (reference.damping - params.force_law_damping), 0.0),
        margin=margin,
        damping_factors=factors,
    )
    return replace(
        params,
        gains=found.gains,
        force_law_damping=found.force_law_damping,
        tracking_gain=found.tracking_gain,
        approach_rate=found.approach_rate,
    )
