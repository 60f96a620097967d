"""What driving takes of the drive force: the first row of Eq. (2) along a planned motion.

The chain's f_b = m u̇1 + d²/dt² Σ p cos α − u2² Σ p cos α (theory/dynamics/chain), where u̇1 =
w_forward − ρ̈ + ρ u2². The arm's own Σ p cos α is taken as linear in the reach, about the goal: the
arm weighs an eighth of the robot, and moves slowly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from defmanip_gym.params import BeamParams, RobotParams
from defmanip_gym.planning.model import Function
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import ArmKinematics, robot_chain


@dataclass(frozen=True, kw_only=True)
class DriveLimit:
    """Largest drive force, and what it depends on.

    Attributes:
        force_n: the limit.
        total_mass_kg: of robot and beam.
        carried_kg: of the beam, which hangs at the reach.
        beam_moment_kg_m: its first moment about the grasp.
        arm_moment_kg_m: Σ p cos α of the arm alone at the goal.
        arm_slope_kg: and what a longer reach adds to it.
        goal_reach_m: ρ*.
    """

    force_n: float
    total_mass_kg: float
    carried_kg: float
    beam_moment_kg_m: float
    arm_moment_kg_m: float
    arm_slope_kg: float
    goal_reach_m: float

    @staticmethod
    def of(robot: RobotParams, beam: BeamParams, goal_pitch: Array) -> DriveLimit:
        """Return the limit of a robot that carries a beam to where its arm has pitches (2,)."""
        chain = robot_chain(robot, beam).constants
        moments = robot_chain(robot).constants.first_moments
        arm = ArmKinematics(robot)
        slopes = np.linalg.solve(arm.jacobian(goal_pitch).T, -moments * np.sin(goal_pitch))
        return DriveLimit(
            force_n=robot.drive_force_limit_n,
            total_mass_kg=float(chain.total_mass),
            carried_kg=beam.mass_kg,
            beam_moment_kg_m=float(chain.first_moments[2:].sum()),
            arm_moment_kg_m=float(moments @ np.cos(goal_pitch)),
            arm_slope_kg=float(slopes[0]),
            goal_reach_m=float(arm.reach_and_height(goal_pitch)[0]),
        )

    def force(
        self,
        state: Sequence[Any],
        rates: Sequence[Any],
        w_forward: Any,
        sin: Function = np.sin,
        cos: Function = np.cos,
    ) -> Any:
        """Return f_b, (...) N.

        Args:
            state: in the order of ``model.STATE``, (...) each.
            rates: its rates of change, (...) each.
            w_forward: of the command, (...) m/s².
            sin: of what the states are made of.
            cos: likewise.
        """
        *_, left, _, reach, _, swing, swing_rate = state
        reach_acceleration, swing_acceleration = rates[8], rates[10]
        turning = (left / reach) ** 2
        arm = self.arm_moment_kg_m + self.arm_slope_kg * (reach - self.goal_reach_m)
        ahead = arm + self.carried_kg * reach + self.beam_moment_kg_m * sin(swing)
        base = w_forward - reach_acceleration + reach * turning
        swinging = cos(swing) * swing_acceleration - sin(swing) * swing_rate**2
        return (
            self.total_mass_kg * base
            + (self.arm_slope_kg + self.carried_kg) * reach_acceleration
            + self.beam_moment_kg_m * swinging
            - turning * ahead
        )
