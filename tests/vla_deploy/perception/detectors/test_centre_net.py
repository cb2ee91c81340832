import re
from dataclasses import replace

import numpy as np
import pytest

from tests.vla_deploy.image_inputs import letterboxed
from vla_deploy.inference.manifest import DetectionOutputs, Tensor
from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.detectors.centre_net import decode, faults, read

STRIDE_PX, SCORE = 4, 0.3
DETECTION = DetectionOutputs(
    adapter="centre_net",
    classes=("cup", "can", "bowl"),
    score_threshold=SCORE,
    iou_threshold=0.5,
    image=letterboxed(64, 48),
)


def maps(*things: tuple[int, int, int, float], size: float = 8.0) -> tuple[np.ndarray, np.ndarray]:
    """Return maps of 3 classes on 12 x 16 cells with a peak per (class, row, column, score)."""
    heat = np.full((3, 12, 16), 0.01, np.float32)
    for index, row, column, score in things:
        heat[index, row, column] = score
    return heat, np.full((4, 12, 16), size, np.float32)


def found(maps: tuple[np.ndarray, np.ndarray], score: float = SCORE) -> Boxes:
    return decode(*maps, stride_px=STRIDE_PX, score_threshold=score, iou_threshold=0.5)


def test_a_peak_becomes_a_box_around_its_cell_s_centre() -> None:
    boxes = found(maps((1, 5, 7, 0.8)))

    assert boxes.classes.tolist() == [1]
    assert boxes.scores.tolist() == pytest.approx([0.8])
    assert boxes.corners_px.tolist() == [[22.0, 14.0, 38.0, 30.0]]


def test_a_box_ends_at_the_image_s_border() -> None:
    boxes = found(maps((0, 0, 15, 0.9)))

    assert boxes.corners_px.tolist() == [[54.0, 0.0, 64.0, 10.0]]


def test_the_slope_around_a_peak_tells_no_further_thing() -> None:
    heat, edges = maps((0, 5, 5, 0.9), (0, 5, 6, 0.7), (0, 4, 5, 0.6))

    assert len(found((heat, edges))) == 1


def test_the_best_of_boxes_of_one_class_on_one_place_is_kept() -> None:
    boxes = found(maps((0, 5, 5, 0.6), (0, 5, 7, 0.9), size=24.0))

    assert boxes.scores.tolist() == pytest.approx([0.9])


def test_a_cup_in_front_of_a_box_is_a_thing_of_its_own() -> None:
    heat, edges = maps((0, 5, 5, 0.6), (1, 6, 7, 0.9))
    edges[:, 6, 7] = 24.0

    assert found((heat, edges)).classes.tolist() == [1, 0]


def test_one_place_may_have_boxes_of_several_classes() -> None:
    boxes = found(maps((0, 5, 5, 0.6), (2, 5, 5, 0.7)))

    assert boxes.classes.tolist() == [2, 0]


def test_unlikely_things_are_not_told() -> None:
    assert len(found(maps((0, 5, 5, 0.2)))) == 0
    assert len(found(maps((0, 5, 5, 0.2)), score=0.1)) == 1


def test_the_surest_things_come_first() -> None:
    boxes = found(maps((0, 1, 1, 0.5), (1, 6, 6, 0.9), (2, 10, 12, 0.7), size=4.0))

    assert boxes.classes.tolist() == [1, 2, 0]


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_box_that_is_no_number_is_left_out(value: float) -> None:
    heat, edges = maps((0, 2, 2, 0.9), (1, 8, 8, 0.8), size=4.0)
    edges[2, 2, 2] = value
    heat[2, 5, 5] = np.nan

    assert found((heat, edges)).classes.tolist() == [1]


def test_outputs_are_read_with_the_manifest_s_size_and_thresholds() -> None:
    heat, edges = maps((1, 5, 7, 0.8), (0, 1, 1, 0.2))

    boxes = read((heat[None], edges[None]), DETECTION)

    assert boxes.classes.tolist() == [1]
    assert boxes.corners_px.tolist() == [[22.0, 14.0, 38.0, 30.0]]
    keen = replace(DETECTION, weak_score_threshold=0.15)
    assert read((heat[None], edges[None]), keen).classes.tolist() == [1, 0]


def outputs(*shapes: tuple[int | str, ...]) -> tuple[Tensor, ...]:
    return tuple(Tensor(name="map", shape=shape, dtype="float32") for shape in shapes)


@pytest.mark.parametrize("heat", [(1, 3, 12, 16), (1, 3, "h", "w")])
def test_maps_of_the_declared_kind_have_no_faults(heat: tuple[int | str, ...]) -> None:
    assert not [*faults(outputs(heat, (1, 4, *heat[2:])), DETECTION)]


@pytest.mark.parametrize(
    ("shapes", "told"),
    [
        (((1, 3, 12, 16),), "got .*12, 16"),
        (((1, 2, 12, 16), (1, 4, 12, 16)), "list of classes"),
        (((1, 3, 12, 16), (1, 4, 12, 15)), "expected heat"),
        (((1, 3, 12, 16), (1, 3, 12, 16)), "edges"),
        (((1, 3, 16), (1, 4, 16)), "expected heat"),
        (((1, 3, 12, 12), (1, 4, 12, 12)), "proportions, got 12 x 12 cells"),
    ],
)
def test_other_outputs_are_refused(shapes: tuple[tuple[int, ...], ...], told: str) -> None:
    (fault,) = faults(outputs(*shapes), DETECTION)

    assert re.search(told, fault)
