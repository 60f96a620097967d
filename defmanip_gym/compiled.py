"""Compiling the functions that every simulated step runs through.

Such functions handle one state, in plain loops and scalar formulas; batches are loops over states
in compiled code as well. So a state's result does not depend on the batch that it is in, and one
environment costs microseconds, not the hundreds that as many small NumPy calls take.

Machine code is kept beside the source for the next run. Numba would take it as current while the
function's own file is; these functions call others, in other files, so all of them count here.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, ParamSpec, TypeAlias, TypeVar

import numba
import numba.extending
from filelock import FileLock
from numba.core.caching import FunctionCache, IndexDataCacheFile

# In functions that are both: a number in compiled code, an array (...) when called from Python.
Numbers: TypeAlias = Any

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


def compiled(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile at the first call, or take the machine code of an earlier run.

    Division by zero gives infinity or NaN, as in NumPy. Without the Global Interpreter Lock.
    """
    jitted = numba.njit(nogil=True, error_model="numpy")(function)
    if hasattr(jitted, "_cache"):  # not with NUMBA_DISABLE_JIT=1, which leaves plain Python
        with suppress(RuntimeError):  # no folder can be written: compile anew in every process
            jitted._cache = _PackageCache(function)
    result: Callable[Parameters, Result] = jitted
    return result


def compilable(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Let compiled functions call this one; called from Python it stays NumPy on batches."""
    marked: Callable[Parameters, Result] = numba.extending.register_jitable(error_model="numpy")(
        function
    )
    return marked


def machine_code(
    function: Callable[Parameters, Result], *examples: Any
) -> Callable[Parameters, Result]:
    """Return a compiled function for arguments of the types of these, without the look-up.

    Looking up the types of twenty arguments takes longer than what most functions here do with
    one state. The caller answers for the types: arrays must be of the examples' dtype, dimension
    and memory layout.

    Args:
        function: made by ``compiled``.
        examples: one argument of each type.
    """
    if not hasattr(function, "overloads"):  # NUMBA_DISABLE_JIT=1
        return function
    signature = tuple(numba.typeof(example) for example in examples)  # type: ignore[no-untyped-call]
    function.compile(signature)  # type: ignore[attr-defined]
    result: Callable[Parameters, Result] = function.overloads[signature].entry_point
    return result


def compiled_sources(package: Path) -> list[Path]:
    """Return the modules of a package that machine code may have been made of.

    Those are the ones that import this module, and the top level, for constants.
    """
    return sorted(
        path
        for path in package.rglob("*.py")
        if path.parent == package or b"compiled import" in path.read_bytes()
    )


@functools.cache
def sources_stamp(package: Path) -> str:
    """Return a hash of ``compiled_sources``."""
    digest = hashlib.blake2b(digest_size=16)
    for path in compiled_sources(package):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class _PackageCache(FunctionCache):
    """Numba's cache, current as long as no compiled source of the package has changed."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        self._lock = FileLock(Path(self._cache_path) / f"{self._impl.filename_base}.lock")
        self._cache_file = IndexDataCacheFile(  # type: ignore[no-untyped-call]
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=sources_stamp(Path(__file__).parent),
        )

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for a signature, or None."""
        loaded = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        # processes that save at once without a lock leave files of other signatures
        return loaded if loaded is not None and loaded.signature.args == tuple(sig) else None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save machine code; one process at a time, as Numba chooses file names by an index."""
        with self._lock:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
