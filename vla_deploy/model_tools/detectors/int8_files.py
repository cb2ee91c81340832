"""Write the int8 files of a model from its fp32 one.

Static, QDQ, weights per channel; activations unsigned for CPUs, signed and symmetric for TensorRT.
What follows the last convolutions stays fp32: boxes of hundreds of pixels and scores below one
share a tensor there, and one scale for both would leave nothing of the scores.
"""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray

from vla_deploy.inference.errors import ModelFileSpoiled, PackageMissing
from vla_deploy.inference.manifest import Variant
from vla_deploy.inference.runtime import SESSION_ERRORS
from vla_deploy.runtime.one_line import one_line

# Activation and weight types, as onnxruntime names them.
TYPES: Final[Mapping[Variant, tuple[str, str]]] = {
    Variant.INT8_U8S8: ("QUInt8", "QInt8"),
    Variant.INT8_S8S8: ("QInt8", "QInt8"),
}
_SYMMETRIC: Final = {"ActivationSymmetric": True, "WeightSymmetric": True}
_CONVOLUTIONS: Final = ("Conv", "ConvTranspose", "Gemm", "MatMul")
# What the tools raise about graphs that they cannot follow.
_TOOL_ERRORS: tuple[type[Exception], ...] = (*SESSION_ERRORS, AssertionError, TypeError, KeyError)
Feed = dict[str, NDArray[Any]]


def write_int8(
    source: Path, paths: Mapping[Variant, Path], inputs: Callable[[], Iterator[Feed]]
) -> None:
    """Write the int8 files; `inputs` begins the calibration inputs, for each file anew.

    Raises:
        PackageMissing: the packages to do so are not installed.
        ModelFileSpoiled: the graph cannot be quantised.
    """
    onnx, tools = _tools()
    with tempfile.TemporaryDirectory() as folder:
        prepared = Path(folder) / "prepared.onnx"
        try:
            _prepare(onnx, tools, source, prepared)
            heads = head_nodes(onnx.load(str(prepared)).graph)
            for variant, path in paths.items():
                _quantise_file(tools, prepared, path, variant, _Reader(inputs()), heads)
        except _TOOL_ERRORS as error:
            told = one_line(error)
            raise ModelFileSpoiled(f"{source}: it cannot be quantised: {told}") from error


def head_nodes(graph: Any) -> list[str]:
    """Return the nodes of an ONNX graph that stay fp32: the last convolutions and what follows.

    A convolution to a single channel reads out a distribution, as YOLO's boxes have one; it is
    taken as what follows, and the ones before it as the last.
    """
    makers = {output: node for node in graph.node for output in node.output}
    weights = {tensor.name: tensor for tensor in graph.initializer}
    heads: dict[str, None] = {}
    wanted = [output.name for output in graph.output]
    while wanted:
        node = makers.get(wanted.pop())
        if node is None or node.name in heads:
            continue
        heads[node.name] = None
        if node.op_type not in _CONVOLUTIONS or _reads_out(node, weights):
            wanted.extend(node.input)
    return [*heads]


def _reads_out(node: Any, weights: Mapping[str, Any]) -> bool:
    weight = weights.get(node.input[1])
    return node.op_type == "Conv" and weight is not None and weight.dims[0] == 1


def _prepare(onnx: Any, tools: Any, source: Path, prepared: Path) -> None:
    """Infer shapes and give every node a name, by which the head is left out."""
    tools.quant_pre_process(str(source), str(prepared), skip_symbolic_shape=True)
    model = onnx.load(str(prepared))
    for number, node in enumerate(model.graph.node):
        node.name = node.name or f"node_{number}"
    onnx.save(model, str(prepared))


def _quantise_file(
    tools: Any, prepared: Path, path: Path, variant: Variant, reader: Any, heads: list[str]
) -> None:
    activations, weights = TYPES[variant]
    tools.quantize_static(
        str(prepared),
        str(path),
        reader,
        quant_format=tools.QuantFormat.QDQ,
        per_channel=True,
        activation_type=getattr(tools.QuantType, activations),
        weight_type=getattr(tools.QuantType, weights),
        nodes_to_exclude=heads,
        extra_options=_SYMMETRIC if variant == Variant.INT8_S8S8 else {},
    )


def _tools() -> tuple[Any, Any]:
    """Import what only this needs.

    Raises:
        PackageMissing: it is not installed.
    """
    try:
        return import_module("onnx"), import_module("onnxruntime.quantization")
    except ImportError as error:
        raise PackageMissing(
            f"quantising needs {error.name}, which is not installed; try: "
            "pip install 'vla-deploy[models]'"
        ) from error


class _Reader:
    """Give onnxruntime the calibration inputs one by one."""

    def __init__(self, feeds: Iterator[Feed]) -> None:
        self._left = feeds

    def get_next(self) -> Feed | None:
        return next(self._left, None)
