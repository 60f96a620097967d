"""Checks of single values; each raises one of the package's own errors."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from defmanip_gym.errors import InvalidValueError, ParameterError

# No mass, length or gain of a robot is beyond this; far beyond it arithmetic overflows.
_LARGEST = 1e6


def require_positive(name: str, value: float, unit: str = "") -> None:
    """Raise ParameterError unless ``value`` is a finite number above zero."""
    allowed = f"a finite number > 0 and < {_LARGEST:g} {unit}".rstrip()
    _require(name, value, lambda number: 0 < number < _LARGEST, allowed)


def require_non_negative(name: str, value: float, unit: str = "") -> None:
    """Raise ParameterError unless ``value`` is a finite number, zero or above."""
    _require(name, value, lambda number: number >= 0, f"a finite number >= 0 {unit}".rstrip())


def require_between(
    name: str, value: float, low: float, high: float, *, remedy: str = "Choose one inside."
) -> None:
    """Raise ParameterError unless ``low < value < high``."""
    _require(
        name, value, lambda number: low < number < high, f"{low:g} < {name} < {high:g}", remedy
    )


def require_whole(name: str, value: int, low: int) -> None:
    """Raise ParameterError unless ``value`` is a whole number, ``low`` or above."""
    if isinstance(value, bool) or not isinstance(value, int) or value < low:
        raise ParameterError(name, value, f"a whole number >= {low}", "Choose one inside.")


def require_finite_sequence(name: str, values: Sequence[float], length: int) -> None:
    """Raise ParameterError unless ``values`` holds ``length`` finite numbers."""
    is_sequence = isinstance(values, Sequence) and not isinstance(values, str)
    if not is_sequence or len(values) != length or not all(map(_is_finite_number, values)):
        raise ParameterError(
            name, values, f"{length} finite numbers", "Check their count and values."
        )


def require_range(
    name: str, ends: Sequence[float], *, may_be_zero: bool = False, unit: str = ""
) -> None:
    """Raise ParameterError unless ``ends`` is (low, high), in order, finite and not negative."""
    is_pair = isinstance(ends, Sequence) and not isinstance(ends, str) and len(ends) == 2
    if is_pair and all(map(_is_finite_number, ends)):
        low, high = ends
        if (0 < low or (may_be_zero and low == 0)) and low <= high < _LARGEST:
            return
    first = "0 <= low" if may_be_zero else "0 < low"
    allowed = f"(low, high) with {first} <= high < {_LARGEST:g} {unit}".rstrip()
    raise ParameterError(name, ends, allowed, "Give two finite numbers, the smaller one first.")


def require_instance(name: str, value: object, kind: type) -> None:
    """Raise ParameterError unless ``value`` is an instance of ``kind``."""
    if not isinstance(value, kind):
        raise ParameterError(
            name, value, f"a {kind.__name__}", f"Pass {name}={kind.__name__}(...)."
        )


def require_choice(
    name: str,
    value: object,
    choices: Collection[str],
    error: type[InvalidValueError] = ParameterError,
) -> None:
    """Raise ``error`` unless ``value`` is one of ``choices``."""
    if value not in choices:
        listed = ", ".join(repr(choice) for choice in choices)
        raise error(name, value, f"one of {listed}", "Check the spelling.")


def _require(name, value, condition, allowed: str, remedy: str = "Choose one inside.") -> None:  # type: ignore[no-untyped-def]
    if not _is_finite_number(value) or not condition(value):
        raise ParameterError(name, value, allowed, remedy)


def _is_finite_number(value: object) -> bool:
    try:
        return not isinstance(value, bool) and math.isfinite(value)  # type: ignore[arg-type]
    except (TypeError, OverflowError):
        return False
