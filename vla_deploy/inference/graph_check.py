"""Compare a loaded graph with what its manifest says of it."""

import ast
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.inference.manifest import Dimension, Manifest, Tensor

MAX_NAN_SHARE: Final = 0.25
_NAMES_KEY: Final = "names"
_DTYPES: Final[Mapping[str, str]] = {"float": "float32", "double": "float64"}


def tensors_of(nodes: Any) -> tuple[Tensor, ...]:
    """Return a session's inputs or outputs as a manifest declares them."""
    return tuple(
        Tensor(
            name=node.name,
            shape=tuple(_dimension(one, axis) for axis, one in enumerate(node.shape)),
            dtype=_dtype(node.type),
        )
        for node in nodes
    )


def graph_faults(
    inputs: tuple[Tensor, ...],
    outputs: tuple[Tensor, ...],
    classes: tuple[str, ...],
    manifest: Manifest,
) -> Iterator[str]:
    """Find every difference in inputs, outputs and, where the graph names them, classes."""
    yield from _tensor_faults("input", inputs, manifest.inputs)
    yield from _tensor_faults("output", outputs, manifest.outputs)
    if manifest.detection is not None and classes:
        yield from _class_faults(classes, manifest.detection.classes)


def output_faults(outputs: Mapping[str, NDArray[Any]], manifest: Manifest) -> Iterator[str]:
    """Find outputs of a run whose shape is not the declared one, or whose values are no numbers."""
    for tensor in manifest.outputs:
        shape = outputs[tensor.name].shape
        if not _same_shape(shape, tensor.shape):
            yield _shape_text("output", tensor.name, shape, tensor.shape)
    yield from number_faults(outputs)


def number_faults(outputs: Mapping[str, NDArray[Any]]) -> Iterator[str]:
    """Find outputs of which too much is NaN, as spoiled weights make it; a few may be left out."""
    for name, values in outputs.items():
        count = int(np.count_nonzero(np.isnan(values))) if values.dtype.kind == "f" else 0
        if count > MAX_NAN_SHARE * values.size:
            yield f"output {name!r}: {count} of its {values.size} values are no numbers"


def class_names(session: Any) -> tuple[str, ...]:
    """Return the classes that the file itself names, in the order of their numbers, or none.

    YOLO exports hold a Python dictionary from number to name.
    """
    text = session.get_modelmeta().custom_metadata_map.get(_NAMES_KEY, "")
    try:
        named = ast.literal_eval(text) if text else {}
    except (ValueError, SyntaxError):
        return ()
    if isinstance(named, dict) and set(named) == set(range(len(named))):
        return tuple(str(named[number]) for number in range(len(named)))
    return tuple(map(str, named)) if isinstance(named, list) else ()


def _tensor_faults(kind: str, got: tuple[Tensor, ...], wanted: tuple[Tensor, ...]) -> Iterator[str]:
    present = {tensor.name: tensor for tensor in got}
    declared = {tensor.name for tensor in wanted}
    for tensor in wanted:
        if tensor.name not in present:
            yield f"{kind} {tensor.name!r}: expected by the manifest, the graph has {[*present]}"
            continue
        real = present[tensor.name]
        if real.dtype != tensor.dtype:
            yield f"{kind} {tensor.name!r}: expected {tensor.dtype}, the graph has {real.dtype}"
        if not _same_shape(real.shape, tensor.shape):
            yield _shape_text(kind, tensor.name, real.shape, tensor.shape)
    for name in present:
        if name not in declared:
            yield f"{kind} {name!r}: in the graph, expected {sorted(declared)} by the manifest"


def _class_faults(named: tuple[str, ...], declared: tuple[str, ...]) -> Iterator[str]:
    if len(named) != len(declared):
        yield f"classes: the file names {len(named)}, the manifest {len(declared)}"
        return
    for number, (theirs, ours) in enumerate(zip(named, declared, strict=True)):
        if theirs != ours:
            yield f"class {number}: the file says {theirs!r}, the manifest {ours!r}"


def _shape_text(
    kind: str, name: str, got: tuple[Dimension, ...], wanted: tuple[Dimension, ...]
) -> str:
    return f"{kind} {name!r}: expected shape {list(wanted)}, the graph has {list(got)}"


def _same_shape(got: tuple[Dimension, ...], wanted: tuple[Dimension, ...]) -> bool:
    """Return whether shapes agree where both are numbers."""
    return len(got) == len(wanted) and all(
        isinstance(one, str) or isinstance(other, str) or one == other
        for one, other in zip(got, wanted, strict=True)
    )


def _dimension(value: object, axis: int) -> Dimension:
    return value if isinstance(value, int) else str(value or f"axis_{axis}")


def _dtype(text: str) -> str:
    """Return numpy's name for what onnxruntime calls `tensor(float)`."""
    name = text.removeprefix("tensor(").removesuffix(")")
    return _DTYPES.get(name, name)
