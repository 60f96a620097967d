"""Colours of contestants in plots: light alone, dark inside a filter."""

from __future__ import annotations

from defmanip_gym.evaluation.options import OPTIONS, OTHER_INNER_LOOP

GUEST_COLOURS = ("#7a5195", "#c77dba", "#e3bfdd")  # of the user's own agents


def contestant_colour(base: str, method: str) -> str:
    """Return a contestant's colour, always the same for a name.

    Args:
        base: its name without the filter.
        method: names the filter; empty for none. The further down the list of options, the greyer.
    """
    own = base.removesuffix(OTHER_INNER_LOOP)
    pair = _COLOURS.get(own) or _MORE_COLOURS[sum(own.encode()) % len(_MORE_COLOURS)]
    colour = pair[0]
    if method:
        colour = _mixed(pair[1], _GREY, OPTIONS.index(method) / len(OPTIONS))
    return colour if own == base else _mixed(colour, _WHITE, _LIGHTER)


def _mixed(colour: str, level: int, share: float) -> str:
    """Return a colour with a share of the grey of a level in it."""
    channels = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    mixed = (round(channel + share * (level - channel)) for channel in channels)
    return "#" + "".join(f"{channel:02x}" for channel in mixed)


_GREY, _WHITE = 0x80, 0xFF
_LIGHTER = 0.3  # on the other inner loop
_COLOURS = {
    "tanner": ("#45b5aa", "#12806a"),
    "oriented": ("#6cc4d6", "#1a7f96"),
    "field": ("#7fb3e6", "#2f7fc1"),
    "lqr": ("#9aa8d8", "#3f51a3"),
    "shaped": ("#a3bf6b", "#5a6e2e"),
    "mpc": ("#d99cc4", "#8a3a76"),
    "time_optimal": ("#6f7f95", "#1b3a6b"),
    "ppo": ("#f0a35e", "#c7651a"),
    "ppo-randomized": ("#e3c04b", "#a8860f"),
    "ppo-storage-v1": ("#f2a899", "#d9482b"),
    "ppo-storage-randomized-v1": ("#cfc78f", "#6f6a1a"),
    "sac-storage-v1": ("#e8a8d0", "#c2186b"),
    "sac": ("#e58a8a", "#b3293b"),
    "tqc": ("#c490d1", "#7b3f8c"),
    "residual": ("#8fcf7a", "#3d8b2d"),
    "lagrangian": ("#bfa58a", "#7a5a38"),
}
_MORE_COLOURS = (("#9aa05a", "#5f6524"), ("#7fb7b0", "#2c6f67"), ("#b5b5d9", "#5b5b9e"))
