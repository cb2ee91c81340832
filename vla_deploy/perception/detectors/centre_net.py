"""Read the maps of a centre network: peaks of the heat are things, with the distances of edges."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vla_deploy.inference.manifest import DetectionOutputs, Tensor
from vla_deploy.perception.detectors.boxes import (
    Boxes,
    Floats,
    Indices,
    suppress_overlaps,
    valid_boxes,
)

Outputs = tuple[NDArray[Any], ...]


def faults(outputs: tuple[Tensor, ...], detection: DetectionOutputs) -> Iterator[str]:
    """Find why these are not heat (1, classes, h, w) and edges (1, 4, h, w)."""
    count, image = len(detection.classes), detection.image
    shapes = [tensor.shape for tensor in outputs]
    are_maps = [len(shape) for shape in shapes] == [4, 4] and shapes[0][2:] == shapes[1][2:]
    if not are_maps or shapes[0][1] != count or shapes[1][1] != 4:
        yield (
            f"expected heat [1, {count}, h, w] and edges [1, 4, h, w], got "
            f"{[list(shape) for shape in shapes]}; is the list of classes right?"
        )
        return
    high, wide = shapes[0][2:]
    sizes = isinstance(high, int) and isinstance(wide, int)
    if sizes and image.width_px * high != image.height_px * wide:
        yield f"expected maps in the image's proportions, got {wide} x {high} cells"


def read(outputs: Outputs, detection: DetectionOutputs) -> Boxes:
    """Return the boxes of heat (1, classes, h, w) and edges (1, 4, h, w)."""
    heat, edges = (np.asarray(output[0], dtype=np.float32) for output in outputs)
    return decode(
        heat,
        edges,
        stride_px=detection.image.width_px / heat.shape[2],
        score_threshold=detection.least_score,
        iou_threshold=detection.iou_threshold,
    )


def decode(
    heat: Floats, edges: Floats, *, stride_px: float, score_threshold: float, iou_threshold: float
) -> Boxes:
    """Return the boxes, the surest first, in pixels of the input.

    `heat` is (classes, h, w), from 0 to 1; `edges` is (4, h, w): distances in pixels from a cell's
    centre to the left, top, right and bottom edge. A cell covers `stride_px` x `stride_px` pixels.
    """
    classes, rows, columns = _peaks(heat, score_threshold)
    left, top, right, bottom = edges[:, rows, columns]
    x, y = (columns + 0.5) * stride_px, (rows + 0.5) * stride_px
    corners = np.stack([x - left, y - top, x + right, y + bottom], axis=1)
    boxes = Boxes(
        corners_px=corners.astype(np.float32),
        scores=heat[classes, rows, columns],
        classes=classes,
    )
    height_px, width_px = (size * stride_px for size in heat.shape[1:])
    inside = _within(valid_boxes(boxes, score_threshold), width_px, height_px)
    return suppress_overlaps(inside, iou_threshold)


def _within(boxes: Boxes, width_px: float, height_px: float) -> Boxes:
    """Return the boxes cut off at the image's borders."""
    border = np.array([width_px, height_px] * 2, dtype=np.float32)
    return replace(boxes, corners_px=boxes.corners_px.clip(0.0, border))


def _peaks(heat: Floats, score_threshold: float) -> tuple[Indices, Indices, Indices]:
    """Return class, row and column of the cells that no neighbour surpasses.

    Only the few cells above the threshold are compared: a filter over the maps takes ten times as
    long.
    """
    classes, rows, columns = np.nonzero(heat >= score_threshold)
    values = heat[classes, rows, columns]
    last_row, last_column = heat.shape[1] - 1, heat.shape[2] - 1
    top = np.ones(len(values), dtype=np.bool_)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            beside_row = (rows + down).clip(0, last_row)
            beside_column = (columns + right).clip(0, last_column)
            top &= heat[classes, beside_row, beside_column] <= values
    return classes[top], rows[top], columns[top]
