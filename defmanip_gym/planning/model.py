"""The transport as a planner sees it: grasp, heading, reach and swing under the command w.

The inner loop realizes w exactly, so base and arm leave four things to plan with: the grasp moves
by w, the heading follows the grasp's leftward velocity, since the base does not slip (u2 = ż_left /
ρ), the reach follows its own rule (Section IV.B), and the swing Eq. (6b). The same formulas serve
numbers, arrays and CasADi's symbols. Derivation and omissions: docs/derivations.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import ParameterError
from defmanip_gym.params import GRAVITY_M_S2, BeamParams, RobotParams
from defmanip_gym.theory.dynamics.redundancy import RedundancyResolution
from defmanip_gym.theory.dynamics.robot_model import components
from defmanip_gym.theory.payload.object_model import HangingBeam

Array = NDArray[np.float64]
Function = Callable[[Any], Any]

# Position from the goal's grasp point in axes of its heading, heading from the goal's, grasp
# velocity in the base frame.
STATE = (
    "x_m",
    "y_m",
    "z_m",
    "heading_rad",
    "forward_m_s",
    "left_m_s",
    "up_m_s",
    "reach_m",
    "reach_rate_m_s",
    "swing_rad",
    "swing_rate_rad_s",
)
POSITION, HEADING, VELOCITY = slice(0, 3), 3, slice(4, 7)
REACH, REACH_RATE, SWING, SWING_RATE = 7, 8, 9, 10
STATE_SIZE, COMMAND_SIZE = len(STATE), 3


@dataclass(frozen=True, kw_only=True)
class TransportModel:
    """Constants of the reduced model; of the beam, all over its inertia J about the grasp.

    Attributes:
        goal_reach_m: ρ*.
        reach_rate_per_s: k of the reach rule.
        reach_gain_per_s: k3 of it.
        coupling_per_m: first moment over J: what w does to the swing.
        stiffness_per_s2: root stiffness over J.
        damping_per_s: d over J.
        spin_share: (J − axial inertia) over J: what turning does to the swing.
    """

    goal_reach_m: float
    reach_rate_per_s: float
    reach_gain_per_s: float
    coupling_per_m: float
    stiffness_per_s2: float
    damping_per_s: float
    spin_share: float

    @staticmethod
    def of(robot: RobotParams, beam: BeamParams, goal_reach_m: float) -> TransportModel:
        """Return the model of a robot that carries a beam of one segment.

        Raises:
            ParameterError: the beam has several.
        """
        if beam.segment_count != 1:
            raise ParameterError(
                "beam.segment_count",
                beam.segment_count,
                "1",
                "Time-optimal plans are made for rigid rods only.",
            )
        rule = RedundancyResolution(robot, goal_reach_m=goal_reach_m).rule
        carried = HangingBeam(beam)
        constants = carried.chain.constants
        inertia = float(constants.second_moments[0, 0] + constants.transverse[0])
        return TransportModel(
            goal_reach_m=float(rule.goal_reach_m),
            reach_rate_per_s=float(rule.k),
            reach_gain_per_s=float(rule.k3),
            coupling_per_m=float(constants.first_moments[0]) / inertia,
            stiffness_per_s2=float(carried.k_o22[0, 0]) / inertia,
            damping_per_s=float(carried.d_o22[0, 0]) / inertia,
            spin_share=1.0 - float(constants.axial[0]) / inertia,
        )

    def storage(self, swing: Any, swing_rate: Any, cos: Function = np.cos) -> Any:
        """Return V of Lemma III.1 over J, (...) 1/s²."""
        raised = GRAVITY_M_S2 * self.coupling_per_m * (1 - cos(swing))
        return 0.5 * swing_rate**2 + 0.5 * self.stiffness_per_s2 * swing**2 + raised


def state_rates(
    model: TransportModel,
    state: Sequence[Any],
    w: Sequence[Any],
    sin: Function = np.sin,
    cos: Function = np.cos,
) -> tuple[Any, ...]:
    """Return the rates of change of the state.

    Args:
        model: its constants.
        state: in the order of ``STATE``, (...) each.
        w: task acceleration in the base frame, (...) m/s² each.
        sin: of what the states are made of.
        cos: likewise.
    """
    _, _, _, heading, forward, left, up, reach, reach_rate, swing, swing_rate = state
    turned_sin, turned_cos, hanging_sin = sin(heading), cos(heading), sin(swing)
    yaw_rate = left / reach
    falling = w[2] + GRAVITY_M_S2
    torque = (
        -model.coupling_per_m * (cos(swing) * w[0] + hanging_sin * falling)
        - model.stiffness_per_s2 * swing
        - model.damping_per_s * swing_rate
        + model.spin_share * hanging_sin * cos(swing) * yaw_rate**2
    )
    reach_force = reach_rate + model.reach_rate_per_s * (reach - model.goal_reach_m)
    return (
        turned_cos * forward - turned_sin * left,
        turned_sin * forward + turned_cos * left,
        up,
        yaw_rate,
        w[0] + yaw_rate * left,
        w[1] - yaw_rate * forward,
        w[2],
        reach_rate,
        -model.reach_gain_per_s * reach_force,
        swing_rate,
        torque,
    )


def advanced(
    model: TransportModel,
    state: Sequence[Any],
    w: Sequence[Any],
    time_s: Any,
    sin: Function = np.sin,
    cos: Function = np.cos,
) -> tuple[Any, ...]:
    """Return the state after ``time_s`` under constant w, by a step of fourth order (RK4)."""

    def moved(rates: Sequence[Any], step: Any) -> tuple[Any, ...]:
        return tuple(value + step * rate for value, rate in zip(state, rates, strict=True))

    first = state_rates(model, state, w, sin, cos)
    second = state_rates(model, moved(first, time_s / 2), w, sin, cos)
    third = state_rates(model, moved(second, time_s / 2), w, sin, cos)
    fourth = state_rates(model, moved(third, time_s), w, sin, cos)
    mean = [
        (a + 2 * (b + c) + d) / 6 for a, b, c, d in zip(first, second, third, fourth, strict=True)
    ]
    return moved(mean, time_s)


def advanced_rows(model: TransportModel, states: Array, w: Array, time_s: Array | float) -> Array:
    """Return states (..., 11) after times (...) under commands (..., 3)."""
    columns = advanced(model, components(states), components(w), time_s)
    return np.stack(columns, axis=-1)
