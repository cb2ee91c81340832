"""Add a person's detector: describe it, try it out on empty images, and only then keep it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from drivers.clock import Clock
from vla_deploy.inference.errors import ImagesInvalid, ModelMismatch, RunFailed
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
from vla_deploy.inference.session import ModelSession, open_session
from vla_deploy.inference.store import ModelStore, StoredModel, sha256_of
from vla_deploy.model_tools.detectors.labelled import read_names
from vla_deploy.model_tools.keeping import CARD, keep_tried, require_free
from vla_deploy.perception.detectors.adapters import ADAPTERS
from vla_deploy.perception.detectors.detector import ROLE, Detector
from vla_deploy.perception.detectors.image_input import Image

_CHANNELS: Final = 3
_SHARE: Final = 1 / 255
_SHAPE: Final = (240, 320, 3)
_UPRIGHT: Final = (360, 200, 3)
_SEED: Final = 1


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

    @property
    def file_name(self) -> str:
        """Return the name that the graph's file is kept under."""
        return f"{self.name}.onnx"


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorTrial:
    """Hold what a detector answered: boxes found in each of the empty images."""

    boxes: Mapping[str, int]

    def __str__(self) -> str:
        counts = ", ".join(f"{name} {count}" for name, count in self.boxes.items())
        doubt = "; it sees things where nothing is: is the input as it was trained?"
        return f"boxes in empty images: {counts}{doubt if any(self.boxes.values()) else ''}"


def empty_images() -> dict[str, Image]:
    """Return images with nothing in them."""
    noise = np.random.default_rng(_SEED).integers(0, 256, _SHAPE, dtype=np.uint8)
    return {
        "black": np.zeros(_SHAPE, dtype=np.uint8),
        "white": np.full(_SHAPE, 255, dtype=np.uint8),
        "grey": np.full(_UPRIGHT, 128, dtype=np.uint8),
        "noise": noise,
    }


def add_model(
    store: ModelStore, source: DetectorSource, *, engines: Path, clock: Clock, replace: bool = False
) -> tuple[StoredModel, DetectorTrial]:
    """Check a model, try it out and keep it; when anything is wrong, nothing has changed.

    Raises:
        ModelUnknown: the name cannot be used, or is taken and `replace` is not set.
        ModelFileSpoiled: the file is no ONNX graph that runs.
        ModelMismatch: input, outputs, classes and adapter do not fit together.
        ImagesInvalid: the file of classes cannot be used.
        RunFailed: it fails on an empty image, or gives what cannot be.
        OSError: the model cannot be stored.
    """
    require_free(store, source.name, replace=replace)
    manifest = describe(source, open_graph(source.onnx))
    return keep_tried(
        store,
        manifest,
        {source.file_name: source.onnx},
        source.card,
        lambda model: try_out(open_session(model, PLAIN_CHOICE, engines=engines, clock=clock)),
    )


def try_out(session: ModelSession) -> DetectorTrial:
    """Run a detector on the empty images, and close its session.

    Raises:
        ModelMismatch: its outputs are not those of its adapter.
        RunFailed: it fails, or gives what cannot be; the image is named.
    """
    boxes = {}
    try:
        detector = Detector(session)
        for name, image in empty_images().items():
            try:
                found = detector.detect(image)
            except RunFailed as error:
                raise RunFailed(f"{error} (on an image that is {name})") from error
            boxes[name] = int((found.scores >= detector.detection.score_threshold).sum())
    finally:
        session.close()
    return DetectorTrial(boxes=boxes)


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
        files={Variant.FP32: ModelFile(path=source.file_name, sha256=sha256_of(source.onnx))},
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
    default_scale = _SHARE if tensor.dtype.startswith("float") else 1.0
    image = ImageInput(
        width_px=width,
        height_px=height,
        layout=layout,
        colour=source.colour,
        fit=source.fit,
        fill=source.fill,
        scale=source.scale if source.scale is not None else default_scale,
        mean=source.mean,
        std=source.std,
    )
    return Tensor(name=tensor.name, shape=shape, dtype=tensor.dtype), image


def _classes(source: DetectorSource, graph: GraphSession) -> tuple[str, ...]:
    """Return the classes by the file that was given, else those that the export names."""
    if source.classes is None:
        if graph.classes:
            return graph.classes
        raise ModelMismatch(str(source.onnx), ("it names no classes; give them by --classes FILE",))
    names = read_names(source.classes)
    if not names or len(set(names)) != len(names):
        raise ImagesInvalid(
            f"{source.classes}: expected a name in each line, none twice; got {names}"
        )
    return names
