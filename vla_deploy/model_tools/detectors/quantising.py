"""Quantise a detector to int8 with a person's images; keep it only if it still sees as well.

Static, QDQ, weights per channel; activations unsigned for CPUs, signed and symmetric for TensorRT.
What follows the last convolutions stays fp32: boxes of hundreds of pixels and scores below one
share a tensor there, and one scale for both would leave nothing of the scores.
"""

import dataclasses
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray

from drivers.clock import Clock
from vla_deploy.inference.errors import (
    AccuracyLost,
    ImagesInvalid,
    ModelFileSpoiled,
    ModelMismatch,
    PackageMissing,
)
from vla_deploy.inference.manifest import DetectionOutputs, Manifest, ModelFile, Variant
from vla_deploy.inference.manifest_file import write_manifest
from vla_deploy.inference.runtime import SESSION_ERRORS
from vla_deploy.inference.store import ModelStore, StoredModel, sha256_of
from vla_deploy.model_tools.detectors.accuracy import Accuracy, measure, with_measured
from vla_deploy.model_tools.detectors.labelled import LabelledImage, read_image
from vla_deploy.perception.detectors.image_input import fit_image
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantised:
    """Hold how well each file sees."""

    model: str
    accuracy: Mapping[Variant, Accuracy]
    drop_points: float

    def document(self) -> dict[str, Any]:
        """Return the figures, as JSON takes them."""
        return dataclasses.asdict(self)


def quantise(
    store: ModelStore,
    model: StoredModel,
    *,
    name: str,
    calibration: Sequence[Path],
    labelled: Sequence[LabelledImage],
    max_drop_points: float,
    engines: Path,
    clock: Clock,
) -> Quantised:
    """Make both int8 files from the fp32 one and install them under a name with it.

    The manifest states what the boxes of the least accurate file are worth.

    Raises:
        AccuracyLost: mAP50 drops by more than `max_drop_points` percent; nothing was installed.
        PackageMissing: the packages to quantise with are not installed.
        ModelUnknown: the name cannot be used.
        ModelMismatch: it is no detector, or has no fp32 file.
        ModelFileSpoiled: its fp32 file is not what was checked in, or cannot be quantised.
        ImagesInvalid: there is nothing to calibrate or to measure with.
    """
    detection = model.manifest.detection
    if detection is None or Variant.FP32 not in model.manifest.files:
        raise ModelMismatch(model.manifest.name, ("expected a detector with an fp32 file",))
    if not calibration or not labelled:
        raise ImagesInvalid("expected images to calibrate and labelled ones to measure with")
    source = model.checked_file(Variant.FP32)
    draft = store.draft(name)
    try:
        _copy_original(model, source, draft, name)
        paths = {variant: draft / f"{name}_{variant}.onnx" for variant in TYPES}
        write_int8(source, paths, lambda: _inputs(model.manifest, detection, calibration))
        made = _describe(model, draft, name, paths)
        accuracy = {
            variant: measure(made, variant, labelled, engines=engines, clock=clock)
            for variant in (Variant.FP32, *TYPES)
        }
        drop_points = _judge(accuracy, max_drop_points)
        write_manifest(draft, with_measured(made.manifest, accuracy))
        store.install(draft)
    finally:
        store.abandon(draft)
    return Quantised(model=name, accuracy=accuracy, drop_points=drop_points)


def require_disjoint(calibration: Sequence[Path], labelled: Sequence[LabelledImage]) -> None:
    """Check that no labelled image is one to calibrate with: on those a file sees better.

    Raises:
        ImagesInvalid: some are.
    """
    known = {path.resolve() for path in calibration}
    shared = [one.path for one in labelled if one.path.resolve() in known]
    if shared:
        raise ImagesInvalid(
            f"--labelled: {len(shared)} of its {len(labelled)} images, such as {shared[0]}, are "
            "among those of --images; expected others, which it was not calibrated with"
        )


def _copy_original(model: StoredModel, source: Path, draft: Path, name: str) -> None:
    shutil.copyfile(source, draft / f"{name}.onnx")
    if model.manifest.card:
        shutil.copyfile(model.folder / model.manifest.card, draft / model.manifest.card)


def _describe(
    model: StoredModel, draft: Path, name: str, paths: Mapping[Variant, Path]
) -> StoredModel:
    every = {Variant.FP32: draft / f"{name}.onnx", **paths}
    files = {
        variant: ModelFile(path=path.name, sha256=sha256_of(path))
        for variant, path in every.items()
    }
    manifest = dataclasses.replace(model.manifest, name=name, files=files)
    return StoredModel(manifest=manifest, folder=draft)


def _judge(accuracy: Mapping[Variant, Accuracy], max_drop_points: float) -> float:
    """Return by how many percent mAP50 drops.

    Raises:
        AccuracyLost: by more than is allowed.
    """
    before = accuracy[Variant.FP32].map50
    drops = {variant: 100.0 * (before - accuracy[variant].map50) for variant in TYPES}
    worst = max(drops, key=lambda variant: drops[variant])
    if drops[worst] > max_drop_points:
        figures = ", ".join(f"{variant} {one.map50:.4f}" for variant, one in accuracy.items())
        raise AccuracyLost(
            f"mAP50 of {worst} drops by {drops[worst]:.2f} points, allowed are {max_drop_points:g} "
            f"({figures}); nothing was installed; calibrate with more images of what the robot sees"
        )
    return drops[worst]


def _inputs(
    manifest: Manifest, detection: DetectionOutputs, images: Sequence[Path]
) -> Iterator[Feed]:
    (tensor,) = manifest.inputs
    for path in images:
        fitted, _ = fit_image(read_image(path), detection.image, tensor.dtype)
        yield {tensor.name: fitted}


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
            reason = one_line(error)
            raise ModelFileSpoiled(f"{source}: it cannot be quantised: {reason}") from error


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
