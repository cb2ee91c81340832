"""Write a decoder of the Llama family as an ONNX graph with a cache of keys and values.

Tensors are named as onnxruntime-genai's own builder names them, so its configuration fits. Needs
onnx and numpy alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

Weights = Mapping[str, NDArray[np.float32]]
_OPSET: Final = 17
_MICROSOFT: Final = "com.microsoft"
_IR_VERSION: Final = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Sizes:
    """Hold the sizes of a decoder; `kv_heads` of the query's heads share a key each."""

    vocabulary: int
    width: int
    layers: int
    heads: int
    kv_heads: int
    head_size: int
    context_tokens: int
    rope_theta: float = 10_000.0
    epsilon: float = 1e-5


@dataclass(slots=True)
class _Graph:
    """Collect nodes and constants."""

    nodes: list[onnx.NodeProto] = field(default_factory=list)
    constants: list[onnx.TensorProto] = field(default_factory=list)

    def constant(self, name: str, values: NDArray[Any]) -> str:
        self.constants.append(numpy_helper.from_array(np.ascontiguousarray(values), name))
        return name

    def add(self, kind: str, inputs: list[str], output: str, **attributes: Any) -> str:
        self.add_several(kind, inputs, [output], **attributes)
        return output

    def add_several(
        self, kind: str, inputs: list[str], outputs: list[str], domain: str = "", **attributes: Any
    ) -> None:
        self.nodes.append(
            helper.make_node(kind, inputs, outputs, outputs[0], domain=domain, **attributes)
        )


def decoder_graph(weights: Weights, sizes: Sizes) -> onnx.ModelProto:
    """Return the graph of a decoder.

    `weights` are named `embedding`, `norm`, and for each layer `N.attention_norm`, `N.query`,
    `N.key`, `N.value`, `N.out`, `N.inner_norm`, `N.gate`, `N.up`, `N.down`; matrices are inputs x
    outputs. Where there are `N.query_bias` and the like, as Qwen has them, they are added.

    Raises:
        KeyError: weights are missing.
    """
    graph = _Graph()
    embedding = graph.constant("embedding", weights["embedding"])
    graph.constant("cosine", _angles(sizes, np.cos))
    graph.constant("sine", _angles(sizes, np.sin))
    _lengths(graph)
    values = graph.add("Gather", [embedding, "input_ids"], "embedded")
    for layer in range(sizes.layers):
        values = _attention(graph, values, weights, sizes, layer)
        values = _thinking(graph, values, weights, sizes, layer)
    values = _norm(graph, values, weights["norm"], "norm", sizes)
    turned = graph.add("Transpose", [embedding], "embedding_turned", perm=[1, 0])
    graph.add("MatMul", [values, turned], "logits")
    return _model(graph, sizes)


def genai_config(sizes: Sizes, *, kind: str, end_id: int, pad_id: int) -> dict[str, Any]:
    """Return the content of `genai_config.json` for such a graph."""
    decoder = {
        "filename": "model.onnx",
        "head_size": sizes.head_size,
        "hidden_size": sizes.width,
        "num_attention_heads": sizes.heads,
        "num_hidden_layers": sizes.layers,
        "num_key_value_heads": sizes.kv_heads,
        "session_options": {"provider_options": []},
        "inputs": {
            "input_ids": "input_ids",
            "attention_mask": "attention_mask",
            "past_key_names": "past_key_values.%d.key",
            "past_value_names": "past_key_values.%d.value",
        },
        "outputs": {
            "logits": "logits",
            "present_key_names": "present.%d.key",
            "present_value_names": "present.%d.value",
        },
    }
    return {
        "model": {
            "type": kind,
            "vocab_size": sizes.vocabulary,
            "context_length": sizes.context_tokens,
            "bos_token_id": pad_id,
            "eos_token_id": end_id,
            "pad_token_id": pad_id,
            "decoder": decoder,
        },
        "search": {"do_sample": False, "max_length": sizes.context_tokens, "num_beams": 1},
    }


def _angles(sizes: Sizes, function: Any) -> NDArray[np.float32]:
    half = sizes.head_size // 2
    rates = sizes.rope_theta ** (-np.arange(half, dtype=np.float64) / half)
    turned = np.outer(np.arange(sizes.context_tokens), rates)
    return np.asarray(function(turned), dtype=np.float32)


def _lengths(graph: _Graph) -> None:
    """Give attention the length of the text: from the mask, which has a one for each token."""
    one = graph.constant("one", np.array([1], dtype=np.int64))
    total = graph.add("ReduceSum", ["attention_mask", one], "mask_sum", keepdims=0)
    first = graph.constant("first", np.array(1, dtype=np.int64))
    before = graph.add("Sub", [total, first], "mask_sum_less_one")
    graph.add("Cast", [before], "lengths", to=TensorProto.INT32)
    shape = graph.add("Shape", ["attention_mask"], "mask_shape")
    length = graph.add("Gather", [shape, first], "mask_length", axis=0)
    graph.add("Cast", [length], "total_length", to=TensorProto.INT32)


def _attention(graph: _Graph, values: str, weights: Weights, sizes: Sizes, layer: int) -> str:
    normed = _norm(
        graph, values, weights[f"{layer}.attention_norm"], f"{layer}.attention_norm", sizes
    )
    parts = [_line(graph, normed, weights, f"{layer}.{name}") for name in ("query", "key", "value")]
    past = [f"past_key_values.{layer}.{name}" for name in ("key", "value")]
    present = [f"present.{layer}.{name}" for name in ("key", "value")]
    graph.add_several(
        "GroupQueryAttention",
        [*parts, *past, "lengths", "total_length", "cosine", "sine"],
        [f"{layer}.seen", *present],
        domain=_MICROSOFT,
        num_heads=sizes.heads,
        kv_num_heads=sizes.kv_heads,
        do_rotary=1,
        rotary_interleaved=0,
    )
    told = _line(graph, f"{layer}.seen", weights, f"{layer}.out")
    return graph.add("Add", [values, told], f"{layer}.attended")


def _thinking(graph: _Graph, values: str, weights: Weights, sizes: Sizes, layer: int) -> str:
    normed = _norm(graph, values, weights[f"{layer}.inner_norm"], f"{layer}.inner_norm", sizes)
    gate = _line(graph, normed, weights, f"{layer}.gate")
    open_by = graph.add("Sigmoid", [gate], f"{layer}.gate_sigmoid")
    gate = graph.add("Mul", [gate, open_by], f"{layer}.gate_silu")
    up = _line(graph, normed, weights, f"{layer}.up")
    thought = graph.add("Mul", [gate, up], f"{layer}.gated")
    down = _line(graph, thought, weights, f"{layer}.down")
    return graph.add("Add", [values, down], f"{layer}.thought")


def _line(graph: _Graph, values: str, weights: Weights, name: str) -> str:
    matrix = graph.constant(f"{name}.weight", weights[name])
    product = graph.add("MatMul", [values, matrix], f"{name}.product")
    if f"{name}_bias" not in weights:
        return product
    bias = graph.constant(f"{name}.bias", weights[f"{name}_bias"])
    return graph.add("Add", [product, bias], f"{name}.sum")


def _norm(graph: _Graph, values: str, scale: NDArray[np.float32], name: str, sizes: Sizes) -> str:
    weight = graph.constant(f"{name}.weight", scale)
    return graph.add(
        "SimplifiedLayerNormalization", [values, weight], f"{name}.scaled",
        axis=-1, epsilon=sizes.epsilon, stash_type=1,
    )  # fmt: skip


def _model(graph: _Graph, sizes: Sizes) -> onnx.ModelProto:
    inputs = [
        helper.make_tensor_value_info("input_ids", TensorProto.INT64, ["batch", "tokens"]),
        helper.make_tensor_value_info("attention_mask", TensorProto.INT64, ["batch", "length"]),
    ]
    logits = ["batch", "tokens", sizes.vocabulary]
    outputs = [helper.make_tensor_value_info("logits", TensorProto.FLOAT, logits)]
    for layer in range(sizes.layers):
        for name in ("key", "value"):
            inputs.append(_cache(f"past_key_values.{layer}.{name}", "past", sizes))
            outputs.append(_cache(f"present.{layer}.{name}", "length", sizes))
    body = helper.make_graph(graph.nodes, "decoder", inputs, outputs, graph.constants)
    opsets = [helper.make_opsetid("", _OPSET), helper.make_opsetid(_MICROSOFT, 1)]
    return helper.make_model(body, opset_imports=opsets, ir_version=_IR_VERSION)


def _cache(name: str, length: str, sizes: Sizes) -> onnx.ValueInfoProto:
    shape = ["batch", sizes.kv_heads, length, sizes.head_size]
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
