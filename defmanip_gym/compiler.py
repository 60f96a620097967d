"""How Numba compiles the functions of ``compiled``: with what they need, and each once.

Left to itself, Numba takes each function through passes for a language of which these use little,
looks up the meaning of every operator anew, and optimizes each function and makes machine code of
it again with every one that calls it.

This reaches into Numba, so it serves one version (``compiled``); others compile in their own way,
with the same results in more time.
"""

from __future__ import annotations

import functools
from typing import Any, ClassVar

from llvmlite import binding as llvm
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder, Flags
from numba.core.compiler_machinery import PassManager
from numba.core.typed_passes import NativeLowering

from defmanip_gym.lowering import CalleeLowering, KernelLowering

# They serve closures, exceptions, `with`, whole arrays, and variables that change their type.
_PASSES_LEFT_OUT = frozenset(
    (
        "dead_branch_prune",
        "find_literally",
        "generic_rewrites",
        "inline_closure_likes",
        "inline_inlinables",
        "inline_overloads",
        "ir_legalization",
        "ir_processing",
        "literal_unroll",
        "LiteralPropagation",
        "make_function_op_code_to_jit_function",
        "nopython_rewrites",
        "nopython_supported_feature_validation",
        "reconstruct_ssa",
        "rewrite_semantic_constants",
        "strip_phis",
        "with_lifting",
    )
)


class _KernelLibrary(JITCodeLibrary):
    """Code that is optimized once, with all that it calls."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        # the loops are over a handful of links, so unrolled or vectorized they gain nothing
        tuning = llvm.create_pipeline_tuning_options(speed_level=1)
        tuning.loop_unrolling = tuning.loop_vectorization = tuning.slp_vectorization = False
        builder = llvm.create_pass_builder(self._codegen._tm, tuning)
        builder.getModulePassManager().run(self._final_module, builder)


class _CalleeLibrary(_KernelLibrary):
    """Code to be linked into that of its callers, and not optimized or turned into machine code."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, for there is no machine code."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> _CalleeLibrary:
        """What is told of a function's Python objects."""
        return self

    def set_env(self, env_name: str, env: Any) -> None:
        """Take note of nothing: these functions have no Python objects."""


class _SettledFlags(Flags):
    """Flags that do not change any more. The same ones are equal, without a look at each.

    Numba looks up operators by them.
    """

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        return self is other

    def copy(self) -> _SettledFlags:
        """Return these."""
        return self


@functools.cache
def _settled(flags: Flags) -> _SettledFlags:
    return _SettledFlags(flags)


class _TypingMemory:
    """Numba's typing rules, which are asked once what a function returns for given types."""

    def __init__(self, rules: Any) -> None:
        self._rules, self._signatures = rules, dict[Any, Any]()
        self.resolve_setitem = functools.cache(rules.resolve_setitem)
        self.resolve_getattr = functools.cache(rules.resolve_getattr)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rules, name)

    def resolve_function_type(self, func: Any, args: Any, kws: Any) -> Any:
        """Return the signature of a call."""
        call = func, tuple(args), tuple(kws.items())
        if call not in self._signatures:
            self._signatures[call] = self._rules.resolve_function_type(func, args, kws)
        return self._signatures[call]


_remembered = functools.cache(_TypingMemory)


class KernelCompiler(CompilerBase):
    """Compiles a function that Python calls."""

    library_class: ClassVar[type[JITCodeLibrary]] = _KernelLibrary
    lowering_pass: ClassVar[type[NativeLowering]] = KernelLowering

    def define_pipelines(self) -> list[PassManager]:
        """Return Numba's passes without those that are not needed."""
        state = self.state
        state.flags, state.typingctx = _settled(state.flags), _remembered(state.typingctx)
        state.library = self.library_class(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        passes = PassManager("kernel")
        for each, description in DefaultPassBuilder.define_nopython_pipeline(state).passes:
            if each is NativeLowering:
                passes.add_pass(self.lowering_pass, description)
            elif each.name() not in _PASSES_LEFT_OUT:
                passes.add_pass(each, description)
        passes.finalize()
        return [passes]


class CalleeCompiler(KernelCompiler):
    """Compiles a function that only compiled functions call."""

    library_class = _CalleeLibrary
    lowering_pass = CalleeLowering
