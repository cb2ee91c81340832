"""Read the outputs of detectors; a manifest names one of these adapters.

Those of YOLO exports are as the network gives them, or filtered by NMS in the graph. Coordinates
are pixels of the input. Scores are those after the sigmoid, which exports of v8 to v12 have in the
graph.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.inference.errors import RunFailed
from vla_deploy.inference.manifest import DetectionOutputs, Dimension, Tensor
from vla_deploy.perception.detectors import centre_net
from vla_deploy.perception.detectors.boxes import Boxes, suppress_overlaps, valid_boxes

Outputs = tuple[NDArray[Any], ...]
_COORDINATES: Final = 4
_END_TO_END: Final = 6  # left, top, right, bottom, score, class


def raw_faults(outputs: tuple[Tensor, ...], detection: DetectionOutputs) -> Iterator[str]:
    """Find why this is no output (1, 4 + classes, boxes), or that transposed."""
    channels = _COORDINATES + len(detection.classes)
    shapes = [tensor.shape for tensor in outputs]
    if not any(_fit(shapes, one) for one in ((None, channels, None), (None, None, channels))):
        yield (
            f"expected one output [1, {channels}, boxes]: 4 coordinates and "
            f"{len(detection.classes)} classes, got {_shown(shapes)}; is the list of classes right?"
        )


def read_raw(outputs: Outputs, detection: DetectionOutputs) -> Boxes:
    """Return the boxes of (1, 4 + classes, n) or (1, n, 4 + classes); duplicates are removed here.

    Raises:
        RunFailed: it is neither, which the graph had left open.
    """
    table = np.asarray(outputs[0][0], dtype=np.float32)
    channels = _COORDINATES + len(detection.classes)
    if channels not in table.shape:
        raise RunFailed(f"told {list(table.shape)} numbers, expected {channels} of each box")
    if table.shape[0] != channels:
        table = table.T
    by_class = table[_COORDINATES:]
    classes = by_class.argmax(axis=0)
    scores = by_class[classes, np.arange(by_class.shape[1])]
    promising = scores >= detection.least_score
    centre, half = table[:2, promising].T, 0.5 * table[2:_COORDINATES, promising].T
    boxes = Boxes(
        corners_px=np.hstack([centre - half, centre + half]),
        scores=scores[promising],
        classes=classes[promising],
    )
    return suppress_overlaps(valid_boxes(boxes, detection.least_score), detection.iou_threshold)


def end_to_end_faults(outputs: tuple[Tensor, ...], detection: DetectionOutputs) -> Iterator[str]:
    """Find why this is no output (1, boxes, 6)."""
    shapes = [tensor.shape for tensor in outputs]
    if not _fit(shapes, (None, None, _END_TO_END)):
        yield (
            f"expected one output [1, boxes, {_END_TO_END}]: corners, score, class; "
            f"got {_shown(shapes)}"
        )


def read_end_to_end(outputs: Outputs, detection: DetectionOutputs) -> Boxes:
    """Return the boxes of (1, n, 6), which have no duplicates: v10, and exports with NMS in them.

    Raises:
        RunFailed: the rows are of another length, which the graph had left open.
    """
    table = np.asarray(outputs[0][0], dtype=np.float32)
    if table.shape[1] != _END_TO_END:
        raise RunFailed(f"told rows of {table.shape[1]} numbers, expected {_END_TO_END}")
    boxes = Boxes(corners_px=table[:, :4], scores=table[:, 4], classes=_class_numbers(table[:, 5]))
    return valid_boxes(boxes, detection.least_score)


def counted_faults(outputs: tuple[Tensor, ...], detection: DetectionOutputs) -> Iterator[str]:
    """Find why these are not the outputs count, boxes (1, n, 4), scores (1, n), classes (1, n)."""
    shapes = [tensor.shape for tensor in outputs]
    others = ((None, None, _COORDINATES), (None, None), (None, None))
    if not any(_fit(shapes, count, *others) for count in ((None,), (None, None))):
        yield (
            "expected four outputs in this order: count [1, 1], boxes [1, n, 4], scores [1, n], "
            f"classes [1, n]; got {_shown(shapes)}"
        )


def read_counted(outputs: Outputs, detection: DetectionOutputs) -> Boxes:
    """Return the boxes of four outputs; rows behind the count are left over from earlier runs.

    Raises:
        RunFailed: the count is no number, or more than there are rows.
    """
    number, corners, scores, classes = outputs
    counted = float(number.reshape(-1)[0])
    most = min(rows.shape[1] for rows in (corners, scores, classes))
    if not 0 <= counted <= most:
        raise RunFailed(f"told a count of {counted:g} boxes, expected 0 to {most}")
    count = int(counted)
    boxes = Boxes(
        corners_px=np.asarray(corners[0, :count], dtype=np.float32),
        scores=np.asarray(scores[0, :count], dtype=np.float32),
        classes=_class_numbers(classes[0, :count]),
    )
    return valid_boxes(boxes, detection.least_score)


def _class_numbers(values: NDArray[Any]) -> NDArray[np.intp]:
    """Return numbers that may have come as floats; what is no number becomes -1."""
    finite = np.isfinite(values)
    return np.where(finite, np.rint(np.where(finite, values, 0)), -1).astype(np.intp)


def _fit(shapes: list[tuple[Dimension, ...]], *expected: tuple[int | None, ...]) -> bool:
    """Return whether shapes are as expected; None fits every size, a free dimension, too."""
    return [len(shape) for shape in shapes] == [len(shape) for shape in expected] and all(
        size is None or isinstance(dimension, str) or dimension == size
        for shape, sizes in zip(shapes, expected, strict=True)
        for dimension, size in zip(shape, sizes, strict=True)
    )


def _shown(shapes: list[tuple[Dimension, ...]]) -> str:
    return " and ".join(str(list(shape)) for shape in shapes) or "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class Adapter:
    """Read one kind of outputs.

    `faults` finds from their declared shapes why they are of another kind. `read` returns boxes in
    pixels of the input, from outputs in the order in which the manifest lists them.
    """

    summary: str
    faults: Callable[[tuple[Tensor, ...], DetectionOutputs], Iterator[str]]
    read: Callable[[Outputs, DetectionOutputs], Boxes]


ADAPTERS: Final[Mapping[str, Adapter]] = {
    "yolo": Adapter(
        summary="YOLO v8, v9, v11, v12 as exported: [1, 4 + classes, boxes], doubles removed here",
        faults=raw_faults,
        read=read_raw,
    ),
    "yolo_end_to_end": Adapter(
        summary="YOLO v10, or any with NMS in the graph: [1, boxes, 6], corners, score, class",
        faults=end_to_end_faults,
        read=read_end_to_end,
    ),
    "yolo_counted": Adapter(
        summary="NMS in the graph, four outputs: count, boxes [1, n, 4], scores, classes",
        faults=counted_faults,
        read=read_counted,
    ),
    "centre_net": Adapter(
        summary="the embedded detector: heat [1, classes, h, w] and edges [1, 4, h, w] in pixels",
        faults=centre_net.faults,
        read=centre_net.read,
    ),
}
