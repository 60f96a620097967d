"""An actor as an ONNX graph: normalization, layers and the bound of the action, in float32."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from defmanip_gym.baselines.learned.actor import MlpActor
from defmanip_gym.errors import InstallationError
from defmanip_gym.task_params import TaskParams

INPUT, OUTPUT = "observation", "action"

# of 2023 and 2024: runtimes of then and later read them
_OPSET, _IR_VERSION = 17, 8
_ACTIVATIONS = {"tanh": "Tanh", "relu": "Relu"}
_ENDS = (("low", -1.0), ("high", 1.0))


def onnx_bytes(actor: MlpActor) -> bytes:
    """Return the file's content: observation (batch, size) to action (batch, 3), both float32.

    Raises:
        InstallationError: the package onnx is not installed.
    """
    onnx = require_onnx()
    graph = _Graph(onnx)
    card = actor.card
    scale = 1.0 / np.sqrt(actor.observation_variance + card.normalization.variance_floor)
    limit = card.normalization.clip
    x = graph.node("Sub", INPUT, graph.constant("mean", actor.observation_mean))
    x = graph.node("Mul", x, graph.constant("scale", scale))
    x = graph.clipped(x, "observation_limit", limit)
    for index, (weight, bias) in enumerate(actor.layers):
        if index:
            x = graph.node(_ACTIVATIONS[card.activation], x)
        names = (f"layers.{index}.weight", f"layers.{index}.bias")
        constants = map(graph.constant, names, (weight, bias))
        x = graph.node("Gemm", x, *constants, transB=1)
    x = graph.node("Tanh", x) if card.squashed else graph.clipped(x, "action_limit", 1.0)
    graph.node("Identity", x, output=OUTPUT)
    made = graph.made(card.observation_size, card.action_size)
    onnx.helper.set_model_props(made, _properties(actor))
    onnx.checker.check_model(made, full_check=True)
    content: bytes = made.SerializeToString(deterministic=True)
    return content


def require_onnx() -> Any:
    """Return the module.

    Raises:
        InstallationError: it is not installed.
    """
    try:
        import onnx
    except ModuleNotFoundError as error:
        raise InstallationError(
            "the package that ONNX files need",
            error.name,
            "one that is installed",
            "Install it with: pip install 'defmanip_gym[onnx]'.",
        ) from error
    return onnx


class _Graph:
    """Nodes one after another.

    Args:
        onnx: the module.
    """

    def __init__(self, onnx: Any) -> None:
        self._onnx = onnx
        self._nodes: list[Any] = []
        self._constants: list[Any] = []

    def constant(self, name: str, values: NDArray[np.float64] | float) -> str:
        """Add a constant and return its name."""
        array = np.asarray(values, dtype=np.float32)
        self._constants.append(self._onnx.numpy_helper.from_array(array, name))
        return name

    def node(self, operator: str, *inputs: str, output: str = "", **attributes: int) -> str:
        """Add a node and return its output's name."""
        output = output or f"{operator.lower()}_{len(self._nodes)}"
        self._nodes.append(
            self._onnx.helper.make_node(operator, list(inputs), [output], **attributes)
        )
        return output

    def clipped(self, x: str, name: str, limit: float) -> str:
        """Add the clipping to ±limit."""
        ends = (self.constant(f"{name}.{end}", sign * limit) for end, sign in _ENDS)
        return self.node("Clip", x, *ends)

    def made(self, observation_size: int, action_size: int) -> Any:
        """Return the model."""
        helper, kind = self._onnx.helper, self._onnx.TensorProto.FLOAT
        graph = helper.make_graph(
            self._nodes,
            "defmanip_gym agent",
            [helper.make_tensor_value_info(INPUT, kind, ["batch", observation_size])],
            [helper.make_tensor_value_info(OUTPUT, kind, ["batch", action_size])],
            self._constants,
        )
        return helper.make_model(
            graph,
            opset_imports=[helper.make_opsetid("", _OPSET)],
            ir_version=_IR_VERSION,
            producer_name="defmanip_gym",
        )


def _properties(actor: MlpActor) -> dict[str, str]:
    """Return what a reader of the file has to know."""
    card, limit = actor.card, TaskParams().max_acceleration_m_s2
    return {
        "env_id": card.env_id,
        "package_version": card.package_version,
        "agent": f"{card.recipe}, seed {card.seed}, digest {actor.digest}",
        "env_kwargs": json.dumps(card.hyperparameters.get("env_kwargs") or {}),
        "trained_inside": card.trained_inside or "nothing",
        "action": f"in [-1, 1]: acceleration of the grasp, forward, left, up, over {limit:g} m/s²",
    }
