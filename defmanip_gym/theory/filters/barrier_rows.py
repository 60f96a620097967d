"""Half spaces in w: the barrier condition ḣ ≥ −γ h of h = level − B, and the speed limit."""

from __future__ import annotations

from math import sqrt

from defmanip_gym.compiled import compilable, compiled
from defmanip_gym.theory.control.control_laws import limited_acceleration
from defmanip_gym.theory.dynamics.chain import Array
from defmanip_gym.theory.dynamics.robot_model import reach_and_height, reach_and_height_slopes
from defmanip_gym.theory.filters.barrier import DecisionRoom, StorageLevels
from defmanip_gym.theory.filters.sensed import Sensed
from defmanip_gym.theory.filters.storage import power_of, storage_at


@compiled
def half_spaces_all(
    setup: StorageLevels,
    gamma: float,
    wished: Array,
    sensed: Sensed,
    room: DecisionRoom,
    slopes: Array,
    bounds: Array,
    limited: Array,
    excess: Array,
    margins: Array,
) -> None:
    """Write the half spaces slope · w ≤ bound of n states, and how wishes and states stand to them.

    A wish is taken for what the speed limiter would leave of it: who wants to go on at the limit
    needs no filter for that.

    Args:
        setup: levels and robot.
        gamma: γ, 1/s.
        wished: commands, (n, 3) m/s².
        sensed: the states.
        room: for intermediate results.
        slopes: (n, C + 1, 3): of the barriers of C beams, over V_σ, 1/s per m/s²; of the speed.
        bounds: (n, C + 1), 1/s and m/s².
        limited: what is left of the wishes, (n, 3) m/s².
        excess: of that over the bound that it exceeds most, or of the wish over the box, (n,).
        margins: (level − B) / V_σ of the beam where it is smallest, (n,).
    """
    limits, beams = setup.limits, len(setup.levels)
    for i in range(len(margins)):
        margins[i] = _barriers(setup, gamma, sensed, i, room, slopes[i], bounds[i])
        _speed_limit(setup, sensed, i, slopes[i, beams], bounds[i])
        limited[i, 0], limited[i, 1], limited[i, 2] = limited_acceleration(
            wished[i, 0],
            wished[i, 1],
            wished[i, 2],
            sensed.velocity_b[i, 0],
            sensed.velocity_b[i, 1],
            sensed.velocity_b[i, 2],
            limits.max_speed_m_s,
            limits.period_s,
        )
        largest = max(abs(wished[i, 0]), abs(wished[i, 1]), abs(wished[i, 2]))
        excess[i] = largest - limits.max_acceleration_m_s2
        for c in range(beams + 1):
            along = 0.0
            for axis in range(3):
                along += slopes[i, c, axis] * limited[i, axis]
            excess[i] = max(excess[i], along - bounds[i, c])


@compilable
def _barriers(
    setup: StorageLevels,
    gamma: float,
    sensed: Sensed,
    i: int,
    room: DecisionRoom,
    slopes: Array,
    bounds: Array,
) -> float:
    """Write the barriers' half spaces, and return what is left to the level.

    Ḃ = −s_f w_f − s_u w_u + u2 u̇2 (I_σ − I_z), damping left out; the base turns by the leftward
    command less what its driving and the reach's growth make: ρ u̇2 = w_l − (u1 + 2 ρ̇) u2.
    """
    model, arm, storage = setup.model, setup.limits.arm, room.storage
    reach, _ = reach_and_height(arm, sensed.pitch[i, 0], sensed.pitch[i, 1])
    rho_1, rho_2, _, _ = reach_and_height_slopes(arm, sensed.pitch[i, 0], sensed.pitch[i, 1])
    reach_rate = rho_1 * sensed.pitch_rate[i, 0] + rho_2 * sensed.pitch_rate[i, 1]
    yaw_rate = sensed.base_velocity[i, 1]
    turned = (sensed.base_velocity[i, 0] + 2.0 * reach_rate) * yaw_rate
    for j in range(len(room.swing)):
        room.swing[j], room.swing_rate[j] = sensed.swing[i, j], sensed.swing_rate[i, j]
        storage.rate[j] = sensed.swing_rate[i, j]
    margin = 1.0
    for c in range(len(setup.levels)):
        stored = storage_at(model, c, room.swing, room.swing_rate, yaw_rate, storage)
        forward, upward, inertia = power_of(model, c, storage)
        leftward, scale = yaw_rate * inertia / reach, 1.0 / model.passes[c]
        left = scale * (setup.levels[c] - stored)
        slopes[c, 0], slopes[c, 1] = -scale * forward, scale * leftward
        slopes[c, 2] = -scale * upward
        bounds[c] = gamma * left + scale * leftward * turned
        margin = min(margin, left)
    return margin


@compilable
def _speed_limit(setup: StorageLevels, sensed: Sensed, i: int, slope: Array, bounds: Array) -> None:
    """Write the half space that touches the limiter's ball where the grasp is heading."""
    limits, square = setup.limits, 0.0
    for axis in range(3):
        square += sensed.velocity_b[i, axis] ** 2
    speed = sqrt(square)
    for axis in range(3):
        slope[axis] = sensed.velocity_b[i, axis] / max(speed, 1e-12)
    # from above the limit it need not get slower, as for the limiter
    bounds[len(bounds) - 1] = max(limits.max_speed_m_s - speed, 0.0) / limits.period_s
