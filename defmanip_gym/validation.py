"""Checks of single values; each returns the plain Python value or raises one of our own errors.

NumPy's scalars and 0-d arrays (and whatever else has ``ndim == 0`` and ``item``) are numbers,
one-dimensional arrays are sequences. Booleans are no numbers, and an array of one element is not
its element.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.errors import InvalidValueError, ParameterError, SeedError

Params = TypeVar("Params")
Item = TypeVar("Item")

# No mass, length or gain of a robot is beyond these; far beyond them arithmetic overflows.
_SMALLEST, _LARGEST = 1e-9, 1e6
_MOST = 10**12

# threads or processes that one machine can be asked for
MOST_WORKERS = 1024


def require_number(
    name: str,
    value: object,
    low: float,
    high: float,
    unit: str = "",
    *,
    remedy: str = "Choose one inside.",
) -> float:
    """Return ``value``, or raise ParameterError unless ``low <= value <= high``."""
    number = _finite(value)
    if number is None or not low <= number <= high:
        allowed = f"a number, {low:g} <= {name} <= {high:g} {unit}".rstrip()
        raise ParameterError(name, value, allowed, remedy)
    return number


def require_positive(name: str, value: object, unit: str = "") -> float:
    """Return ``value``, or raise ParameterError unless it is a number above zero."""
    return require_number(name, value, _SMALLEST, _LARGEST, unit)


def require_non_negative(name: str, value: object, unit: str = "") -> float:
    """Return ``value``, or raise ParameterError unless it is a number, zero or above."""
    return require_number(name, value, 0.0, _LARGEST, unit)


def require_between(
    name: str, value: object, low: float, high: float, *, remedy: str = "Choose one inside."
) -> float:
    """Return ``value``, or raise ParameterError unless ``low < value < high``."""
    number = _finite(value)
    if number is None or not low < number < high:
        raise ParameterError(name, value, f"{low:g} < {name} < {high:g}", remedy)
    return number


def require_whole(name: str, value: object, low: int, high: int = _MOST) -> int:
    """Return ``value``, or raise ParameterError unless it is a whole number in [low, high]."""
    number = _unwrapped(value)
    is_whole = isinstance(number, numbers.Integral) and not isinstance(number, bool)
    if not is_whole or not low <= int(number) <= high:
        allowed = f"a whole number, {low} <= {name} <= {high:,}"
        raise ParameterError(name, value, allowed, "Choose one inside.")
    return int(number)


def require_flag(name: str, value: object) -> bool:
    """Return ``value``, or raise ParameterError unless it is True or False."""
    flag = _unwrapped(value)
    if not isinstance(flag, bool):
        raise ParameterError(name, value, "True or False", "Choose one.")
    return flag


def require_finite_sequence(name: str, values: object, length: int) -> tuple[float, ...]:
    """Return ``values``, or raise ParameterError unless they are ``length`` numbers."""
    items = _items(values)
    found = None if items is None else tuple(map(_finite, items))
    plain = () if found is None else tuple(each for each in found if each is not None)
    if found != plain or len(plain) != length or max(map(abs, plain), default=0.0) > _LARGEST:
        allowed = f"{length} numbers between -{_LARGEST:g} and {_LARGEST:g}"
        raise ParameterError(name, values, allowed, "Check their count and values.")
    return plain


def require_range(
    name: str, ends: object, low: float, high: float, unit: str = ""
) -> tuple[float, float]:
    """Return ``ends``, or raise ParameterError unless they are (first, last) in [low, high]."""
    found = [_finite(end) for end in _items(ends) or ()]
    if len(found) == 2 and found[0] is not None and found[1] is not None:
        first, last = found[0], found[1]
        if low <= first <= last <= high:
            return first, last
    allowed = f"(low, high) with {low:g} <= low <= high <= {high:g} {unit}".rstrip()
    raise ParameterError(name, ends, allowed, "Give two numbers, the smaller one first.")


def require_array(name: str, values: object, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return a new array, or raise ParameterError unless ``values`` are numbers of that shape."""
    array = number_array(values)
    if array is None or array.shape != shape or not np.isfinite(array).all():
        raise ParameterError(name, values, f"finite numbers of shape {shape}", "Check them.")
    return array


def require_items(name: str, values: object, kind: type[Item]) -> tuple[Item, ...]:
    """Return ``values``, or raise ParameterError unless they are a sequence of ``kind``."""
    items = _items(values)
    found = tuple(each for each in items or () if isinstance(each, kind))
    if items is None or len(found) < len(items):
        raise ParameterError(name, values, f"a sequence of {kind.__name__}", "Write a tuple.")
    return found


def require_instance(name: str, value: object, kind: type) -> None:
    """Raise ParameterError unless ``value`` is an instance of ``kind``."""
    if not isinstance(value, kind):
        raise ParameterError(
            name, value, f"a {kind.__name__}", f"Pass {name}={kind.__name__}(...)."
        )


def require_params(name: str, value: object, kind: type[Params]) -> Params:
    """Return ``value`` of a dataclass, or what a mapping of its fields makes, as JSON holds it.

    Raises:
        ParameterError: something else, a field that there is not or that is missing, or one that
            the class refuses.
    """
    if not isinstance(value, Mapping):
        require_instance(name, value, kind)
        assert isinstance(value, kind)
        return value
    known = {field.name: field for field in fields(kind)}  # type: ignore[arg-type]
    needed = {
        field.name
        for field in known.values()
        if field.default is MISSING and field.default_factory is MISSING
    }
    if not needed <= set(value) <= set(known):
        raise ParameterError(
            name,
            sorted(map(str, value)),
            f"a {kind.__name__} or a mapping with its fields, {', '.join(known)}",
            "Check their names; those without a default have to be there.",
        )
    return kind(**value)


def require_choice(
    name: str,
    value: object,
    choices: Collection[str],
    error: type[InvalidValueError] = ParameterError,
) -> None:
    """Raise ``error`` unless ``value`` is one of ``choices``."""
    if not isinstance(value, str) or value not in choices:
        listed = ", ".join(repr(choice) for choice in choices)
        raise error(name, value, f"one of {listed}", "Check the spelling.")


def require_seed(value: object) -> int | None:
    """Return a seed for one generator, or raise SeedError unless it is whole and >= 0, or None."""
    number = _unwrapped(value)
    if number is None:
        return None
    if not isinstance(number, numbers.Integral) or number < 0:
        raise SeedError("seed", value, "a whole number >= 0, or None", "Draw one with NumPy.")
    return int(number)


def require_seeds(value: object, count: int) -> list[int | None]:
    """Return a seed, or None, for each of ``count`` generators.

    Args:
        value: the seed of the first, others then count on; None; or one of these for each.
        count: of generators.

    Raises:
        SeedError: a seed that is none, or another number of them.
    """
    seeds = _items(value)
    if seeds is None:
        first = require_seed(value)
        return [None if first is None else first + index for index in range(count)]
    if len(seeds) != count:
        allowed = f"a whole number >= 0, or {count} of them or None"
        raise SeedError("seed", value, allowed, "Give one per episode.")
    return [require_seed(seed) for seed in seeds]


def plain(value: Any) -> Any:
    """Return parameters as JSON holds them: mappings for dataclasses, lists for arrays, tuples."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, tuple | list):
        return [plain(each) for each in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def settle(instance: object, name: str, require: Callable[..., object], *arguments: Any) -> None:
    """Give a field of a frozen dataclass, while it is made, the plain value that a check returns.

    A mapping in the place of parameters changes what it names, and the rest is as in the field's
    own default, which need not be that of the parameters' class.

    Args:
        instance: the dataclass.
        name: of the field.
        require: a check from this module; called with name, value, and ``arguments``.
        arguments: of the check.
    """
    value = getattr(instance, name)
    if isinstance(value, Mapping):
        (own,) = (each for each in fields(instance) if each.name == name)  # type: ignore[arg-type]
        default = own.default if own.default_factory is MISSING else own.default_factory()
        value = _completed(value, default)
    object.__setattr__(instance, name, require(name, value, *arguments))


def number_array(values: object) -> NDArray[np.float64] | None:
    """Return numbers of any shape as a new array, or None where they are none."""
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "biufO":
            return None
        if array.dtype == np.float64 and isinstance(values, list | tuple):
            return array  # which is new, and a step is short
        return np.array(array, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError, RuntimeError):  # the last one is PyTorch's
        return None


def _completed(given: Mapping[Any, Any], default: object) -> Mapping[Any, Any]:
    """Return a mapping with the other fields of a dataclass in it; as it is if it fits none."""
    if not is_dataclass(default) or isinstance(default, type):
        return given
    own = {field.name: getattr(default, field.name) for field in fields(default)}
    if not set(given) <= set(own):
        return given  # whose check tells of the names as they were written
    changed = {
        name: _completed(value, own[name]) if isinstance(value, Mapping) else value
        for name, value in given.items()
    }
    return own | changed


def _unwrapped(value: Any) -> Any:
    """Return what a scalar of NumPy or an array without dimensions holds."""
    return value.item() if getattr(value, "ndim", None) == 0 else value


def _items(values: Any) -> list[Any] | None:
    """Return the items of a sequence or one-dimensional array, or None of anything else."""
    if getattr(values, "ndim", None) == 1:
        return list(values.tolist())
    if isinstance(values, Sequence) and not isinstance(values, str | bytes | bytearray):
        return list(values)
    return None


def _finite(value: object) -> float | None:
    """Return a real, finite number as Python's own, or None of anything else."""
    number = _unwrapped(value)
    if isinstance(number, bool) or not isinstance(number, numbers.Real):
        return None
    try:
        plain = float(number)
    except OverflowError:
        return None
    return plain if math.isfinite(plain) else None
