"""Compiling the functions that every simulated step runs through.

Such functions handle one state, in plain loops and scalar formulas; batches are loops over states
in compiled code as well. So a state's result does not depend on the batch that it is in, and one
environment costs microseconds, not the hundreds that as many small NumPy calls take.

Machine code is kept beside the source for the next run. Numba would take it as current while the
function's own file is; these functions call others, in other files, so all of them count here.
"""

from __future__ import annotations

import functools
import gc
import glob
import hashlib
import logging
import os
import pickle
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, ParamSpec, TypeAlias, TypeVar

import numba
import numba.extending
from filelock import FileLock
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache
from numba.core.compiler_lock import global_compiler_lock

# In functions that are both: a number in compiled code, an array (...) when called from Python.
Numbers: TypeAlias = Any

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")

# A child that is forked while another thread compiles would wait for that thread for ever.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=global_compiler_lock.acquire,
        after_in_parent=global_compiler_lock.release,
        after_in_child=global_compiler_lock.release,
    )


_LEANER_FOR = "0.68."  # what compiler.py and lowering.py reach into is that of this Numba


def _options() -> tuple[dict[str, Any], dict[str, Any]]:
    """Return Numba's options for functions that Python calls, and that compiled ones call."""
    # nobody calls these from C
    common = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
    if not numba.__version__.startswith(_LEANER_FOR):
        return common, common
    from defmanip_gym.compiler import CalleeCompiler, KernelCompiler

    common["_nrt"] = False  # without arrays of their own there are no references to count
    callees = {"pipeline_class": CalleeCompiler, "no_cpython_wrapper": False}
    return common | {"pipeline_class": KernelCompiler}, common | callees


_KERNEL, _CALLEE = _options()


def compiled(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile at the first call, or take the machine code of an earlier run.

    Division by zero gives infinity or NaN, as in NumPy. Without the Global Interpreter Lock. Such
    functions write into arrays that they are given; they make none, and raise nothing. What only
    they call is ``compilable``.
    """
    jitted = numba.njit(**_KERNEL)(function)
    if hasattr(jitted, "_cache"):  # not with NUMBA_DISABLE_JIT=1, which leaves plain Python
        try:
            jitted._cache = _PackageCache(function)
        except RuntimeError:  # no folder can be written: compile anew in every process
            jitted._cache = _NothingKept()
    result: Callable[Parameters, Result] = jitted
    return result


def compilable(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Let compiled functions call this one; called from Python it stays Python.

    Such a function may well be called with arrays from Python, if its formulas are NumPy's.
    """
    marked: Callable[Parameters, Result] = numba.extending.register_jitable(**_CALLEE)(function)
    return marked


def chosen_by_type(functions: Mapping[type, Callable[..., Any]]) -> Callable[..., Any]:
    """Return a function that is one of several ``compilable`` ones, by its first argument's type.

    The type is that of a named tuple. Compiled code has no other than the one it was compiled for.
    """

    def chosen(first: Any, *others: Any) -> Any:
        return functions[type(first)](first, *others)

    def implementation(first: Any, *others: Any) -> Callable[..., Any] | None:
        return functions.get(getattr(first, "instance_class", type(None)))

    numba.extending.overload(chosen, jit_options=_CALLEE, strict=False)(  # type: ignore[arg-type]
        implementation
    )
    return chosen


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


@contextmanager
def without_garbage_collection() -> Iterator[None]:
    """Do not search for garbage among the many objects that compiling makes, and keeps."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


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


_UNTOLD = iter((True,))


def _tell_once(what_is_kept: str) -> None:
    """Say once in a process that it compiles; where a user sees it, whom the seconds surprise."""
    if next(_UNTOLD, False):
        logging.getLogger("defmanip_gym").warning(
            "defmanip_gym: compiling, which takes some seconds; %s", what_is_kept
        )


class _NothingKept(NullCache):
    """In place of a cache where no folder can be written."""

    def load_overload(self, sig: Any, target_context: Any) -> None:
        """Return None, for there is nothing."""
        _tell_once(
            "no folder for machine code can be written, so every process will do so. "
            "Set NUMBA_CACHE_DIR to a folder that can."
        )


class _PackageCache(FunctionCache):
    """Numba's cache, current as long as no compiled source of the package has changed."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        stamp = sources_stamp(Path(__file__).parent)
        base = self._impl.filename_base
        self._lock_path = Path(self._cache_path) / f"{base}.lock"
        self._cache_file = IndexDataCacheFile(  # type: ignore[no-untyped-call]
            cache_path=self._cache_path, filename_base=base, source_stamp=stamp
        )
        # Numba writes the index first. A process killed before it has written the machine code
        # must not leave an index of these sources that names the code of others.
        self._cache_file._data_name_pattern = f"{base}.{stamp}.{{number:d}}.nbc"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for a signature, or None."""
        try:
            loaded = super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except (OSError, EOFError, ValueError, pickle.UnpicklingError):  # damaged files
            loaded = None
        # processes that save at once without a lock leave files of other signatures
        if loaded is not None and loaded.signature.args == tuple(sig):
            return loaded
        _tell_once(f"the machine code is kept for the next time (in {self._cache_path}).")
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save machine code; one process at a time, as Numba chooses file names by an index.

        The lock is made anew each time: one made before a fork is of no use in the child. A disk
        that is full or can no longer be written keeps nobody from computing.
        """
        with suppress(OSError, NotImplementedError), FileLock(self._lock_path):
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
            self._clear()

    def _clear(self) -> None:
        """Remove what other sources and killed processes have left."""
        kept = {self._lock_path.name, self._cache_file._index_name}
        kept.update(self._cache_file._load_index().values())  # type: ignore[no-untyped-call]
        for path in self._lock_path.parent.glob(f"{glob.escape(self._impl.filename_base)}.*"):
            if path.name not in kept:
                path.unlink(missing_ok=True)
