"""Typed Numba code into LLVM's: variables, loops and elements of arrays by few instructions.

Numba's general way to an element takes fifty, which LLVM then removes.
"""

from __future__ import annotations

import operator
from collections import defaultdict
from typing import Any

from numba.core import cgutils, ir, types
from numba.core.analysis import compute_cfg_from_blocks, compute_use_defs
from numba.core.compiler_machinery import register_pass
from numba.core.ir_utils import find_const, get_definition, guard
from numba.core.lowering import Lower
from numba.core.typed_passes import NativeLowering
from numba.np.arrayobj import load_item, store_item

_INSTRUCTIONS = {operator.add: "fadd", operator.sub: "fsub", operator.mul: "fmul"}


class _KernelLower(Lower):
    def _find_singly_assigned_variable(self) -> None:
        """Let variables be values where every use has their one assignment behind it.

        Numba does so within one block; others become memory, which LLVM then removes.
        """
        dominators = compute_cfg_from_blocks(self.blocks).dominators()
        assigned, used = defaultdict(list), defaultdict(set)
        for place, block in self.blocks.items():
            for assignment in block.find_insts(ir.Assign):
                assigned[assignment.target.name].append(place)
        # uses in the block of the assignment and after it are not among these
        for place, names in compute_use_defs(self.blocks).usemap.items():
            for name in names:
                used[name].add(place)
        self._singly_assigned_vars = {
            name
            for name, (first, *others) in assigned.items()
            if not others
            and all(first < place and first in dominators[place] for place in used[name])
        }
        self._blk_local_varmap = dict[str, Any]()

    def lower_expr(self, resty: Any, expr: Any) -> Any:
        """Return the value of an expression; counting by ones needs no division and no error."""
        if expr.op != "getiter" or resty != types.range_iter64_type or not self._is_by_ones(expr):
            return super().lower_expr(resty, expr)
        build, limits = self.builder, self.loadvar(expr.value.name)
        first, stop, step = (build.extract_value(limits, place) for place in range(3))
        loop = cgutils.create_struct_proxy(resty)(self.context, build)
        loop.iter, loop.stop, loop.step = cgutils.alloca_once_value(build, first), stop, step
        loop.count = cgutils.alloca_once_value(build, build.sub(stop, first))
        return loop._getvalue()

    def _is_by_ones(self, expr: Any) -> bool:
        call = guard(get_definition, self.func_ir, expr.value)
        return (
            isinstance(call, ir.Expr)
            and call.op == "call"
            and getattr(self.typeof(call.func.name), "typing_key", None) is range
            and len(call.args) < 3  # start and stop
        )

    def lower_getitem(self, resty: Any, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        """Return an element; Numba makes views."""
        pointer = self._element(value, index)
        if pointer is None:
            return super().lower_getitem(resty, expr, value, index, signature)
        array = self.typeof(value.name)
        element = load_item(self.context, self.builder, array, pointer)
        return self.context.cast(self.builder, element, array.dtype, resty)

    def lower_setitem(self, target_var: Any, index_var: Any, value_var: Any, signature: Any) -> Any:
        """Write an element; Numba writes into views."""
        pointer = self._element(target_var, index_var)
        if pointer is None:
            return super().lower_setitem(target_var, index_var, value_var, signature)
        array, kind = self.typeof(target_var.name), self.typeof(value_var.name)
        value = self.context.cast(self.builder, self.loadvar(value_var.name), kind, array.dtype)
        return store_item(self.context, self.builder, array, value, pointer)

    def lower_binop(self, resty: Any, expr: Any, op: Any) -> Any:
        """Return sums, differences, products and squares of two numbers; Numba does the rest."""
        kinds = self.typeof(expr.lhs.name), self.typeof(expr.rhs.name), resty
        if op is operator.pow and guard(find_const, self.func_ir, expr.rhs) == 2:
            if kinds[0] == resty == types.float64:
                base = self.loadvar(expr.lhs.name)
                return self.builder.fmul(base, base)
        elif op in _INSTRUCTIONS and kinds == (types.float64,) * 3:
            instruction = getattr(self.builder, _INSTRUCTIONS[op])
            return instruction(self.loadvar(expr.lhs.name), self.loadvar(expr.rhs.name))
        return super().lower_binop(resty, expr, op)

    def _element(self, array_var: Any, index_var: Any) -> Any:
        """Return the address of an element, or None where the indices do not name one."""
        array, index = self.typeof(array_var.name), self.typeof(index_var.name)
        is_tuple = isinstance(index, types.BaseTuple)
        kinds = tuple(index) if is_tuple else (index,)
        if (
            not isinstance(array, types.Array)
            or array.layout not in "CA"
            or self.context.enable_boundscheck
            or len(kinds) != array.ndim
            or not all(isinstance(kind, types.Integer) for kind in kinds)
        ):
            return None
        build, context = self.builder, self.context
        model, value = context.data_model_manager[array], self.loadvar(array_var.name)
        shape = model.get(build, value, "shape")
        given, constants = self.loadvar(index_var.name), self._constants(index_var, len(kinds))
        offset = context.get_constant(types.intp, 0)
        for axis, (kind, constant) in enumerate(zip(kinds, constants, strict=True)):
            length = build.extract_value(shape, axis)
            if isinstance(constant, int) and constant >= 0:
                place = context.get_constant(types.intp, constant)
            else:
                place = build.extract_value(given, axis) if is_tuple else given
                place = context.cast(build, place, kind, types.intp)
                is_negative = build.icmp_signed("<", place, place.type(0))
                place = build.select(is_negative, build.add(place, length), place)
            if array.layout == "C":
                offset = build.add(build.mul(offset, length), place) if axis else place
            else:
                strides = model.get(build, value, "strides")
                step = build.mul(place, build.extract_value(strides, axis))
                offset = build.add(offset, step)
        data = model.get(build, value, "data")
        if array.layout == "C":
            return build.gep(data, [offset])
        return cgutils.pointer_add(build, data, offset)

    def _constants(self, index_var: Any, count: int) -> list[Any]:
        """Return each index that is written as a number, None for the others."""
        definition = guard(get_definition, self.func_ir, index_var)
        is_tuple = isinstance(definition, ir.Expr) and definition.op == "build_tuple"
        variables = definition.items if is_tuple else [index_var] * count
        return [guard(find_const, self.func_ir, variable) for variable in variables]


class _CalleeLower(_KernelLower):
    def create_cpython_wrapper(self, release_gil: bool = False) -> None:
        """Write no entry for Python, which does not call this one."""


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(NativeLowering):
    """For functions that Python calls."""

    _name = "kernel_lowering"
    lowering_class = _KernelLower


@register_pass(mutates_CFG=True, analysis_only=False)
class CalleeLowering(NativeLowering):
    """For functions that only compiled ones call."""

    _name = "callee_lowering"
    lowering_class = _CalleeLower
