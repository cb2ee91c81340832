import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest

from drivers.clock import MonotonicClock
from vla_deploy.inference.errors import ModelMismatch, RunFailed
from vla_deploy.inference.manifest import Tensor, Variant
from vla_deploy.inference.session import open_session
from vla_deploy.inference.store import ModelStore
from vla_deploy.perception.detectors.adapters import read_counted, read_end_to_end
from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.detectors.detector import Detector

COLOURS = {"red": (255, 0, 0), "green": (0, 255, 0), "blue": (0, 0, 255)}
SCORE, IOU = 0.25, 0.3


@pytest.mark.parametrize("count", [-1.0, 3.0, math.inf, math.nan])
def test_a_count_that_cannot_be_is_refused(count: float, blob_manifest) -> None:
    rows = (np.zeros((1, 2, 4)), np.full((1, 2), 0.9), np.zeros((1, 2)))

    with pytest.raises(RunFailed, match="expected 0 to 2"):
        read_counted((np.array([[count]]), *rows), blob_manifest.detection)


def test_rows_of_another_length_are_refused(blob_manifest) -> None:
    with pytest.raises(RunFailed, match="rows of 5 numbers, expected 6"):
        read_end_to_end((np.zeros((1, 2, 5)),), blob_manifest.detection)


def tensors(*shapes: tuple[str, tuple[int, ...], str]) -> tuple[Tensor, ...]:
    return tuple(Tensor(name=name, shape=shape, dtype=dtype) for name, shape, dtype in shapes)


@pytest.fixture
def open_graph(tmp_path, lay_out, blob_manifest, cpu_choice) -> Callable[..., Detector]:
    def open_graph(graph, **changes) -> Detector:
        detection = dataclasses.replace(
            blob_manifest.detection,
            **{key: changes.pop(key) for key in ("adapter", "classes") if key in changes},
        )
        manifest = dataclasses.replace(blob_manifest, detection=detection, **changes)
        lay_out(tmp_path, manifest, {Variant.FP32: graph.SerializeToString()})
        model = ModelStore(tmp_path, tmp_path / "none").load("blobs")
        return Detector(
            open_session(model, cpu_choice(), engines=tmp_path / "e", clock=MonotonicClock())
        )

    return open_graph


@pytest.fixture
def scene() -> np.ndarray:
    """A red bar, a green block that lies across cells, a weak blue one, and grey all around."""
    rgb = np.full((64, 96, 3), 90, dtype=np.uint8)
    rgb[8:16, 8:40] = COLOURS["red"]
    rgb[36:52, 60:76] = COLOURS["green"]
    rgb[48:56, 0:4] = COLOURS["blue"]
    return rgb


def reference(blobs, rgb: np.ndarray) -> list[tuple[str, float, tuple[float, ...]]]:
    """Go through the cells one by one, and through all pairs of boxes of a class."""
    scores = blobs.score_table(rgb)
    across = blobs.width_px // blobs.cell_px
    found = []
    for cell in range(scores.shape[1]):
        best = max(range(3), key=lambda one: scores[one, cell])
        if scores[best, cell] < SCORE:
            continue
        x = (cell % across + 0.5) * blobs.cell_px
        y = (cell // across + 0.5) * blobs.cell_px
        half = blobs.box_px / 2
        found.append((best, float(scores[best, cell]), (x - half, y - half, x + half, y + half)))
    found.sort(key=lambda one: -one[1])
    kept: list[tuple[int, float, tuple[float, ...]]] = []
    for one in found:
        if not any(one[0] == other[0] and overlap(one[2], other[2]) > IOU for other in kept):
            kept.append(one)
    return [
        (list(COLOURS)[number], score, tuple(np.clip(box, 0, (96, 64, 96, 64))))
        for number, score, box in kept
    ]


def overlap(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    wide = min(one[2], other[2]) - max(one[0], other[0])
    high = min(one[3], other[3]) - max(one[1], other[1])
    shared = max(0.0, wide) * max(0.0, high)
    areas = [(box[2] - box[0]) * (box[3] - box[1]) for box in (one, other)]
    return shared / (sum(areas) - shared)


def same(boxes: Boxes, classes: tuple[str, ...], expected) -> None:
    assert len(expected) >= 3, "a scene with nothing in it proves nothing"
    told = [
        (classes[number], round(float(score), 4), tuple(np.round(corners, 3).tolist()))
        for number, score, corners in zip(
            boxes.classes, boxes.scores, boxes.corners_px, strict=True
        )
    ]
    wanted = [
        (name, round(score, 4), tuple(float(round(v, 3)) for v in box))
        for name, score, box in expected
    ]
    assert sorted(told) == sorted(wanted)
    assert list(boxes.scores) == sorted(boxes.scores, reverse=True)


@pytest.mark.parametrize("transposed", [False, True])
def test_raw_outputs_of_either_order_are_read_and_freed_of_doubles(
    open_graph, blobs, scene, transposed
):
    shape = (1, 96, 7) if transposed else (1, 7, 96)
    detector = open_graph(
        blobs.raw(transposed=transposed), outputs=tensors(("output", shape, "float32"))
    )
    same(detector.detect(scene), detector.detection.classes, reference(blobs, scene))


def test_end_to_end_outputs_are_read_as_they_are(open_graph, blobs, scene):
    detector = open_graph(
        blobs.end_to_end(count=96),
        adapter="yolo_end_to_end",
        outputs=tensors(("output", (1, 96, 6), "float32")),
    )
    found = detector.detect(scene)
    scores = blobs.score_table(scene)
    assert len(found) == int((scores.max(axis=0) >= SCORE).sum()) > len(reference(blobs, scene))
    names = {detector.detection.classes[number] for number in found.classes}
    assert names == {"red", "green", "blue"}


def test_what_a_graph_with_nms_leaves_behind_its_count_is_not_read(open_graph, blobs, scene):
    detector = open_graph(
        blobs.counted(),
        adapter="yolo_counted",
        outputs=tensors(
            ("num", (1, 1), "int32"),
            ("det_boxes", (1, 10, 4), "float32"),
            ("det_scores", (1, 10), "float32"),
            ("det_classes", (1, 10), "int32"),
        ),
    )
    same(detector.detect(scene), detector.detection.classes, reference(blobs, scene))


def test_boxes_come_back_in_the_pixels_of_a_letterboxed_image(open_graph, blobs):
    detector = open_graph(blobs.raw())
    rgb = np.full((256, 192, 3), 90, dtype=np.uint8)  # fits as 48 x 64, with 24 px on each side
    rgb[96:128, 64:96] = COLOURS["green"]
    (box,) = detector.detect(rgb).corners_px
    # Its cells are 24..32 of the input, 40..48 with the padding; a box is 20 px wide there.
    assert box.tolist() == pytest.approx([4 * (44 - 24 - 10), 4 * (28 - 10), 120, 152])


def test_a_grey_image_shows_nothing(open_graph, blobs):
    assert len(open_graph(blobs.raw()).detect(np.full((64, 96, 3), 90, dtype=np.uint8))) == 0


def test_a_list_of_classes_that_is_too_short_is_told(open_graph, blobs):
    with pytest.raises(ModelMismatch) as caught:
        open_graph(blobs.raw(), classes=("red", "green"))
    assert str(caught.value) == (
        "blobs, adapter yolo: expected one output [1, 6, boxes]: 4 coordinates and 2 classes, "
        "got [1, 7, 96]; is the list of classes right?"
    )


@pytest.mark.parametrize(
    ("adapter", "expected"),
    [
        ("yolo_end_to_end", "expected one output [1, boxes, 6]: corners, score, class; got"),
        ("yolo_counted", "expected four outputs in this order: count [1, 1], boxes [1, n, 4]"),
        ("ssd", "detection.adapter: got 'ssd', expected one of yolo, "),
    ],
)
def test_an_adapter_of_another_kind_is_told(open_graph, blobs, adapter, expected):
    with pytest.raises(ModelMismatch) as caught:
        open_graph(blobs.raw(), adapter=adapter)
    assert expected in str(caught.value)


def test_a_class_that_is_in_no_list_is_refused(open_graph, blobs, scene):
    detector = open_graph(
        blobs.end_to_end(),
        adapter="yolo_end_to_end",
        outputs=tensors(("output", (1, 12, 6), "float32")),
        classes=("red", "green"),
    )
    with pytest.raises(RunFailed, match=r"blobs: told class \[2\], its manifest lists 2: 0 to 1"):
        detector.detect(scene)


def test_scores_without_a_sigmoid_are_refused(open_graph, blobs, scene):
    graph = blobs.raw()
    for weight in graph.graph.initializer:
        if weight.name == "high":
            weight.raw_data = np.float32(9).tobytes()
        if weight.name == "same":
            weight.raw_data = (9 * np.eye(3, dtype=np.float32)).tobytes()
    with pytest.raises(RunFailed, match="told a score of 9, expected 0 to 1; is the sigmoid"):
        open_graph(graph).detect(scene)


def test_boxes_that_are_not_numbers_are_left_out(open_graph, blobs, scene):
    graph = blobs.raw()
    for weight in graph.graph.initializer:
        if weight.name == "boxes":
            values = np.frombuffer(weight.raw_data, dtype=np.float32).reshape(1, 4, -1).copy()
            values[0, 0, : values.shape[2] // 2] = np.nan
            weight.raw_data = values.tobytes()
    found = open_graph(graph).detect(scene)
    assert np.isfinite(found.corners_px).all()
    assert set(found.classes) == {1, 2}
