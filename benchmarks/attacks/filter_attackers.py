"""Attackers that play through a safety filter: they know the swing and want it beyond σ."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from defmanip_gym.observation import ObservationLayout

Rng = np.random.Generator


class Attackers:
    """One attacker for each episode of a batch, drawn from all kinds.

    Args:
        layout: of the observations.
        count: episodes.
        rng: draws kinds, holding times and commands.
        names: of the kinds; by default those against beams.
        see: what they look at in observations.
    """

    def __init__(
        self,
        layout: ObservationLayout,
        count: int,
        rng: Rng,
        *,
        names: tuple[str, ...] | None = None,
        see: Callable[[ObservationLayout, np.ndarray], Seen] | None = None,
    ) -> None:
        self._layout, self._count, self._rng = layout, count, rng
        self._names, self._see = names or tuple(KINDS), see or Seen
        self.kinds = rng.integers(len(self._names), size=count)
        self._holding = rng.integers(1, 16, size=count)  # control periods
        self._held = rng.choice((-1.0, 1.0), (count, 3))

    def act(self, observation: np.ndarray, step: int) -> np.ndarray:
        """Return actions, (n, 3)."""
        changing = step % self._holding == 0
        fresh = self._rng.choice((-1.0, 1.0), (self._count, 3))
        self._held = np.where(changing[:, None], fresh, self._held)
        seen = self._see(self._layout, observation)
        actions = np.empty((self._count, 3))
        for index, name in enumerate(self._names):
            rows = self.kinds == index
            actions[rows] = ATTACKS[name](seen, self._held, step)[rows]
        return actions


class Seen:
    """What attackers look at, (n,) each: signs of what pumps, and the motion."""

    def __init__(self, layout: ObservationLayout, observation: np.ndarray) -> None:
        swing = layout.part(observation, "swing")
        rate = layout.part(observation, "swing_rate")
        # segments nearer to the grasp carry more
        weights = np.arange(swing.shape[1], 0, -1) - 0.5
        self.forward = sign((weights * np.cos(swing) * rate).sum(axis=1))
        self.upward = sign((weights * np.sin(swing) * rate).sum(axis=1))
        self.leftward = sign(swing[:, 0])  # beams do not feel it
        self.twisting = self.leftward
        self.tip = sign(rate[:, -1])
        self.velocity = layout.part(observation, "grasp_velocity_b")
        self.yaw_rate = layout.part(observation, "base_velocity")[:, 1]


def sign(values: np.ndarray) -> np.ndarray:
    """Return the signs, never zero."""
    return np.where(values < 0, -1.0, 1.0)


def resonant(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Push with the swing, nothing else."""
    return np.stack((-seen.forward, 0 * seen.forward, 0 * seen.forward), axis=1)


def lifting(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Push with the swing, and pump the vertical."""
    return np.stack((-seen.forward, 0 * seen.forward, -seen.upward), axis=1)


def everything(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Push and lift with the swing, and turn as fast as can be."""
    return np.stack((-seen.forward, sign(seen.yaw_rate), -seen.upward), axis=1)


def chattering(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Hold corners of the action box for some periods."""
    return held


def pushing_and_chattering(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Push with the swing while the other axes hold corners."""
    return np.stack((-seen.forward, held[:, 1], held[:, 2]), axis=1)


def tip(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Push with the last segment, hold corners otherwise."""
    return np.stack((-seen.tip, held[:, 1], held[:, 2]), axis=1)


def turning(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Turn fast while the swing goes out and slowly while it comes back."""
    return np.stack((-seen.forward, sign(seen.yaw_rate) * seen.upward, held[:, 2]), axis=1)


def along_the_limit(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Drive at the speed limit, forwards or backwards, and push only to stay there."""
    ahead = sign(seen.velocity[:, 0])
    fast = np.linalg.norm(seen.velocity, axis=1) > 1.9
    return np.stack((np.where(fast, -seen.forward, ahead), held[:, 1], 0 * ahead), axis=1)


def into_the_arm(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Drive the arm to its ends and push there."""
    up = np.where(held[:, 2] * sign(np.sin(0.02 * step + held[:, 1])) > 0, 1.0, -1.0)
    return np.stack((-seen.forward, held[:, 1], up), axis=1)


def against_braking(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Ask for what the filter is least willing to give: more of the present motion."""
    return np.stack((-seen.forward, sign(seen.velocity[:, 1]), sign(seen.velocity[:, 2])), axis=1)


def whirling(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Push with the swing in all directions."""
    return np.stack((-seen.forward, -seen.leftward, -seen.upward), axis=1)


def sideways(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Push to the side with the swing, hold corners otherwise."""
    return np.stack((held[:, 0], -seen.leftward, held[:, 2]), axis=1)


def twisting(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Turn such that the yaw acceleration feeds the swing, push with it forwards."""
    return np.stack((-seen.forward, seen.twisting, held[:, 2]), axis=1)


def circling(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Drive in circles at the speed limit, half of them backwards, and push with the swing."""
    ahead = sign(held[:, 2]) if step < 40 else sign(seen.velocity[:, 0])
    fast = np.linalg.norm(seen.velocity, axis=1) > 1.8
    aside = np.where(fast & (step % 3 == 0), -seen.leftward, sign(seen.yaw_rate))
    return np.stack((np.where(fast, -seen.forward, ahead), aside, 0 * ahead), axis=1)


def reversing(seen: Seen, held: np.ndarray, step: int) -> np.ndarray:
    """Drive backwards, where the robot jackknifes, pushing to the side with the swing."""
    slow = seen.velocity[:, 0] > -1.7
    return np.stack((np.where(slow, -1.0, -seen.forward), -seen.leftward, -seen.upward), axis=1)


_Attack = Callable[[Seen, np.ndarray, int], np.ndarray]
KINDS: dict[str, _Attack] = {
    attack.__name__: attack
    for attack in (
        resonant,
        lifting,
        everything,
        chattering,
        pushing_and_chattering,
        tip,
        turning,
        along_the_limit,
        into_the_arm,
        against_braking,
    )
}
# what objects that swing in any direction feel besides
ATTACKS: dict[str, _Attack] = KINDS | {
    attack.__name__: attack for attack in (whirling, sideways, twisting, circling, reversing)
}
