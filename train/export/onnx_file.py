"""An exported policy as ONNX."""

import importlib.util
import json
from pathlib import Path
from typing import Any

import numpy as np

from mjx_hand.errors import InputError
from mjx_hand.player.exported_policy import ExportedPolicy

OPSET, IR_VERSION = 17, 8  # of 2022: runtimes on robots are not new


def check_onnx() -> None:
    """Raise InputError unless the package that writes ONNX is installed."""
    if importlib.util.find_spec("onnx") is None:
        raise InputError("to=onnx needs the package onnx; install it with: pip install 'mjx-hand[export]'")


def save_onnx(policy: ExportedPolicy, path: Path) -> None:
    """Write the policy, `features` (batch, n) to `action` and `residual` (batch, m), with its contract as metadata."""
    import onnx  # pyright: ignore[reportMissingImports]  # an extra
    from onnx import helper, numpy_helper  # pyright: ignore[reportMissingImports]

    constants: dict[str, Any] = {
        "offset": policy.offset,
        "scale": policy.scale,
        "low": np.float32(-policy.limit),
        "high": np.float32(policy.limit),
        "least": np.float32(-1),
        "most": np.float32(1),
        "place": np.arange(policy.residual_place.start, policy.residual_place.stop, dtype=np.int64),
        "smoothing": np.float32(policy.smoothing),
        "gain": np.float32(1 - policy.smoothing) * policy.residual_scale,
    }
    nodes: list[Any] = [
        helper.make_node("Sub", ["features", "offset"], ["centred"]),
        helper.make_node("Mul", ["centred", "scale"], ["scaled"]),
        helper.make_node("Clip", ["scaled", "low", "high"], ["x0"]),
    ]
    last = len(policy.layers) - 1
    for k, layer in enumerate(policy.layers):
        constants |= {f"kernel{k}": layer.kernel, f"bias{k}": layer.bias}
        nodes.append(helper.make_node("Gemm", [f"x{k}", f"kernel{k}", f"bias{k}"], [f"y{k}"]))
        if k < last:
            nodes.append(helper.make_node("Sigmoid", [f"y{k}"], [f"gate{k}"]))
            nodes.append(helper.make_node("Mul", [f"y{k}", f"gate{k}"], [f"x{k + 1}"]))
    nodes += [
        helper.make_node("Clip", [f"y{last}", "least", "most"], ["action"]),
        helper.make_node("Gather", ["features", "place"], ["before"], axis=1),
        helper.make_node("Mul", ["before", "smoothing"], ["kept"]),
        helper.make_node("Mul", ["action", "gain"], ["added"]),
        helper.make_node("Add", ["kept", "added"], ["residual"]),
    ]

    def value(name: str, size: int) -> Any:
        return helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, ["batch", size])

    actions = policy.residual_scale.size
    graph = helper.make_graph(
        nodes,
        "policy",
        [value("features", policy.offset.size)],
        [value("action", actions), value("residual", actions)],
        [numpy_helper.from_array(np.asarray(array), name) for name, array in constants.items()],
    )
    model = helper.make_model(
        graph, producer_name="mjx-hand", opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION
    )
    helper.set_model_props(model, {"digest": policy.digest, "contract": json.dumps(policy.contract)})
    onnx.checker.check_model(model, full_check=True)
    path.write_bytes(model.SerializeToString())
