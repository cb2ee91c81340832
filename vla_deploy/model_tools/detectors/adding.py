"""Add a person's detector: describe it, try it out, and only then keep it."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from drivers.clock import Clock
from vla_deploy.inference.errors import ImagesInvalid, ModelMismatch
from vla_deploy.inference.manifest import (
    DetectionOutputs,
    Fit,
    ImageInput,
    Manifest,
    ModelFile,
    Tensor,
    TensorLayout,
    Variant,
)
from vla_deploy.inference.opening import PLAIN_CHOICE, GraphSession, open_graph
from vla_deploy.inference.session import open_session
from vla_deploy.inference.store import ModelStore, StoredModel, sha256_of
from vla_deploy.model_tools.detectors.trial import DetectorTrial, try_out
from vla_deploy.model_tools.keeping import CARD, keep_tried, require_free
from vla_deploy.perception.detectors.adapters import ADAPTERS
from vla_deploy.perception.detectors.detector import ROLE, Detector

_CHANNELS: Final = 3
_SHARE: Final = 1 / 255


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorSource:
    """Hold what a person says of a detector; what is None is taken from the file itself.

    Pixels are divided by 255 where `scale` is None, but for an input of integers.
    `size_px` is width and height, for a graph whose input has none.
    """

    name: str
    onnx: Path
    classes: Path | None
    adapter: str | None
    size_px: tuple[int, int] | None
    summary: str
    licence: str
    card: Path | None
    colour: str
    fit: Fit
    fill: int
    scale: float | None
    mean: tuple[float, float, float]
    std: tuple[float, float, float]
    score_threshold: float
    iou_threshold: float


def add_model(
    store: ModelStore, source: DetectorSource, *, engines: Path, clock: Clock, replace: bool = False
) -> tuple[StoredModel, DetectorTrial]:
    """Check a model, try it out and keep it; when anything is wrong, nothing has changed.

    Raises:
        ModelUnknown: the name cannot be used, or is taken and `replace` is not set.
        ModelFileSpoiled: the file is no ONNX graph that runs.
        ModelMismatch: input, outputs, classes and adapter do not fit together.
        ImagesInvalid: the file of classes cannot be used.
        RunFailed: it fails on an empty image, or tells what cannot be.
        OSError: the model cannot be stored.
    """
    require_free(store, source.name, replace=replace)
    manifest = describe(source, open_graph(source.onnx))
    return keep_tried(
        store,
        manifest,
        {_file_name(source): source.onnx},
        source.card,
        lambda model: try_model(model, engines=engines, clock=clock),
    )


def try_model(model: StoredModel, *, engines: Path, clock: Clock) -> DetectorTrial:
    """Run a detector on the CPU, on images with nothing in them.

    Raises:
        InferenceError: it does not run; each kind says why.
    """
    detector = Detector(open_session(model, PLAIN_CHOICE, engines=engines, clock=clock))
    try:
        return try_out(detector)
    finally:
        detector.close()


def describe(source: DetectorSource, graph: GraphSession) -> Manifest:
    """Return the manifest for a source and the graph that it is about.

    Raises:
        ModelMismatch: they do not fit together.
        ImagesInvalid: the file of classes cannot be used.
    """
    tensor, image = _image_input(source, graph)
    classes = _classes(source, graph)
    detection = DetectionOutputs(
        adapter=source.adapter or "",
        classes=classes,
        score_threshold=source.score_threshold,
        iou_threshold=source.iou_threshold,
        image=image,
    )
    return Manifest(
        name=source.name,
        role=ROLE,
        summary=source.summary,
        licence=source.licence,
        card=CARD if source.card else "",
        inputs=(tensor,),
        outputs=graph.outputs,
        files={Variant.FP32: ModelFile(path=_file_name(source), sha256=sha256_of(source.onnx))},
        detection=_with_adapter(source, graph, detection),
    )


def _with_adapter(
    source: DetectorSource, graph: GraphSession, detection: DetectionOutputs
) -> DetectionOutputs:
    """Return the detection with an adapter: the one that was named, or the only one that fits."""
    fitting = [
        name
        for name, adapter in ADAPTERS.items()
        if source.adapter in (None, name) and not any(adapter.faults(graph.outputs, detection))
    ]
    if len(fitting) == 1:
        return replace(detection, adapter=fitting[0])
    if fitting:
        fault = f"outputs fit {' and '.join(fitting)}; say which by --adapter"
        raise ModelMismatch(str(source.onnx), (fault,))
    wanted = [source.adapter] if source.adapter else [*ADAPTERS]
    faults = tuple(
        f"adapter {name}: {fault}"
        for name in wanted
        for fault in ADAPTERS[name].faults(graph.outputs, detection)
    )
    raise ModelMismatch(str(source.onnx), faults)


def _image_input(source: DetectorSource, graph: GraphSession) -> tuple[Tensor, ImageInput]:
    """Return the input as declared, its free dimensions settled, and how an image becomes it."""
    if len(graph.inputs) != 1 or len(graph.inputs[0].shape) != 4:
        shapes = [list(tensor.shape) for tensor in graph.inputs]
        fault = f"expected one image as input, [1, 3, height, width], got {shapes}"
        raise ModelMismatch(str(source.onnx), (fault,))
    (tensor,) = graph.inputs
    layout = TensorLayout.NHWC if tensor.shape[3] == _CHANNELS else TensorLayout.NCHW
    height, width = tensor.shape[1:3] if layout == TensorLayout.NHWC else tensor.shape[2:4]
    if isinstance(width, str) or isinstance(height, str):
        if source.size_px is None:
            fault = f"its input {list(tensor.shape)} has no size; give one by --size WIDTHxHEIGHT"
            raise ModelMismatch(str(source.onnx), (fault,))
        width, height = source.size_px
    shape = (1, 3, height, width) if layout == TensorLayout.NCHW else (1, height, width, 3)
    image = ImageInput(
        width_px=width,
        height_px=height,
        layout=layout,
        colour=source.colour,
        fit=source.fit,
        fill=source.fill,
        scale=_scale(tensor) if source.scale is None else source.scale,
        mean=source.mean,
        std=source.std,
    )
    return Tensor(name=tensor.name, shape=shape, dtype=tensor.dtype), image


def _scale(tensor: Tensor) -> float:
    return _SHARE if tensor.dtype.startswith("float") else 1.0


def _classes(source: DetectorSource, graph: GraphSession) -> tuple[str, ...]:
    """Return the classes by the file that was given, else those that the export names."""
    if source.classes is None:
        if graph.classes:
            return graph.classes
        raise ModelMismatch(str(source.onnx), ("it names no classes; give them by --classes FILE",))
    try:
        lines = source.classes.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ImagesInvalid(f"{source.classes}: expected a name in each line: {error}") from error
    names = tuple(line.strip() for line in lines if line.strip())
    if not names or len(set(names)) != len(names):
        raise ImagesInvalid(
            f"{source.classes}: expected a name in each line, none twice; got {names}"
        )
    return names


def _file_name(source: DetectorSource) -> str:
    return f"{source.name}.onnx"
