"""What a sampled robot makes of a command: the mean acceleration of a period, known beforehand.

The forces of (28) hold for a control period while velocities change. Positions are taken half a
period ahead, velocities are not, so the accelerations that velocities make, J̇_A u of Eq. (1)
differentiated, are those of its beginning. In its middle they are others, by what is put in here.
"""

from __future__ import annotations

from defmanip_gym.compiled import compilable
from defmanip_gym.theory.dynamics.redundancy import ReachRule, shared_acceleration
from defmanip_gym.theory.dynamics.robot_model import (
    ArmLengths,
    reach_and_height,
    reach_and_height_bias,
    reach_and_height_slopes,
)


@compilable
def mean_acceleration(
    arm: ArmLengths,
    rule: ReachRule,
    w_forward: float,
    w_left: float,
    w_up: float,
    upper: float,
    fore: float,
    upper_rate: float,
    fore_rate: float,
    u1: float,
    u2: float,
    period_s: float,
) -> tuple[float, float, float, float]:
    """Return the period's mean acceleration, m/s² in the base frame of its middle, and u̇2.

    Args:
        arm: its geometry.
        rule: of the reach.
        w_forward: command, m/s².
        w_left: likewise.
        w_up: likewise.
        upper: α1 at the beginning, rad.
        fore: α2.
        upper_rate: α̇1, rad/s.
        fore_rate: α̇2.
        u1: of the base, m/s.
        u2: rad/s.
        period_s: the control period.
    """
    half = 0.5 * period_s
    upper, fore = upper + half * upper_rate, fore + half * fore_rate
    u1_dot, u2_dot, upper_dot, fore_dot = shared_acceleration(
        arm, rule, w_forward, w_left, w_up, upper, fore, upper_rate, fore_rate, u1, u2
    )
    reach, _ = reach_and_height(arm, upper, fore)
    rho_1, rho_2, _, _ = reach_and_height_slopes(arm, upper, fore)
    reach_bias, height_bias = reach_and_height_bias(arm, upper, fore, upper_rate, fore_rate)
    reach_rate = rho_1 * upper_rate + rho_2 * fore_rate
    upper_rate, fore_rate = upper_rate + half * upper_dot, fore_rate + half * fore_dot
    later_reach_bias, later_height_bias = reach_and_height_bias(
        arm, upper, fore, upper_rate, fore_rate
    )
    later_reach_rate = rho_1 * upper_rate + rho_2 * fore_rate
    later_u1, later_u2 = u1 + half * u1_dot, u2 + half * u2_dot
    return (
        w_forward + later_reach_bias - reach_bias - reach * (later_u2**2 - u2**2),
        w_left + (2 * later_reach_rate + later_u1) * later_u2 - (2 * reach_rate + u1) * u2,
        w_up + later_height_bias - height_bias,
        u2_dot,
    )
