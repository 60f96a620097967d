"""Colours of learned contestants in plots: alone, inside a filter, inside a certificate."""

from __future__ import annotations

GUEST_COLOURS = ("#7a5195", "#c77dba")  # of the user's own agents


def family_colours(family: str) -> tuple[str, str, str]:
    """Return a family's colours, always the same for a name; the last one is greyer."""
    pair = _COLOURS.get(family) or _MORE_COLOURS[sum(family.encode()) % len(_MORE_COLOURS)]
    channels = (int(pair[1][i : i + 2], 16) for i in (1, 3, 5))
    greyer = "#" + "".join(f"{(channel + _GREY) // 2:02x}" for channel in channels)
    return (*pair, greyer)


_GREY = 0x80
_COLOURS = {
    "ppo": ("#f0a35e", "#c7651a"),
    "ppo-randomized": ("#e3c04b", "#a8860f"),
    "sac": ("#e58a8a", "#b3293b"),
    "tqc": ("#c490d1", "#7b3f8c"),
    "residual": ("#8fcf7a", "#3d8b2d"),
    "lagrangian": ("#bfa58a", "#7a5a38"),
}
_MORE_COLOURS = (("#9aa05a", "#5f6524"), ("#7fb7b0", "#2c6f67"), ("#b5b5d9", "#5b5b9e"))
