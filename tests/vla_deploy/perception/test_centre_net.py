import numpy as np
import pytest

from vla_deploy.perception.centre_net import decode, overlap

STRIDE_PX = 4


def maps(*things: tuple[int, int, int, float], size: float = 8.0) -> tuple[np.ndarray, np.ndarray]:
    """Return maps of 3 classes on 12 x 16 cells with a peak per (class, row, column, score)."""
    heat = np.full((3, 12, 16), 0.01, np.float32)
    for index, row, column, score in things:
        heat[index, row, column] = score
    return heat, np.full((4, 12, 16), size, np.float32)


def test_a_peak_becomes_a_box_around_its_cell_s_centre() -> None:
    boxes = decode(*maps((1, 5, 7, 0.8)), stride_px=STRIDE_PX)

    assert boxes.classes.tolist() == [1]
    assert boxes.scores.tolist() == pytest.approx([0.8])
    assert boxes.edges_px.tolist() == [[22.0, 14.0, 38.0, 30.0]]


def test_a_box_ends_at_the_image_s_border() -> None:
    boxes = decode(*maps((0, 0, 15, 0.9)), stride_px=STRIDE_PX)

    assert boxes.edges_px.tolist() == [[54.0, 0.0, 64.0, 10.0]]


def test_the_slope_around_a_peak_tells_no_further_thing() -> None:
    heat, edges = maps((0, 5, 5, 0.9), (0, 5, 6, 0.7), (0, 4, 5, 0.6))

    assert len(decode(heat, edges, stride_px=STRIDE_PX)) == 1


def test_the_best_of_boxes_of_one_class_on_one_place_is_kept() -> None:
    boxes = decode(*maps((0, 5, 5, 0.6), (0, 5, 7, 0.9), size=24.0), stride_px=STRIDE_PX)

    assert boxes.scores.tolist() == pytest.approx([0.9])


def test_a_cup_in_front_of_a_box_is_a_thing_of_its_own() -> None:
    heat, edges = maps((0, 5, 5, 0.6), (1, 6, 7, 0.9))
    edges[:, 6, 7] = 24.0

    assert decode(heat, edges, stride_px=STRIDE_PX).classes.tolist() == [1, 0]


def test_one_box_gets_one_class() -> None:
    boxes = decode(*maps((0, 5, 5, 0.6), (2, 5, 5, 0.7)), stride_px=STRIDE_PX)

    assert boxes.classes.tolist() == [2]


def test_unlikely_things_are_not_told() -> None:
    assert len(decode(*maps((0, 5, 5, 0.2)), stride_px=STRIDE_PX)) == 0
    assert len(decode(*maps((0, 5, 5, 0.2)), stride_px=STRIDE_PX, min_score=0.1)) == 1


def test_no_more_boxes_are_told_than_asked_for_and_the_best_first() -> None:
    things = [(0, 4 * k, 4 * j, 0.5 + 0.01 * (4 * k + j)) for k in range(3) for j in range(4)]
    boxes = decode(*maps(*things, size=4.0), stride_px=STRIDE_PX, max_boxes=5)

    assert boxes.scores.tolist() == pytest.approx([0.61, 0.6, 0.59, 0.58, 0.57])


@pytest.mark.parametrize(
    ("heat", "edges"),
    [((3, 12, 16), (4, 12, 15)), ((12, 16), (4, 12, 16)), ((3, 12, 16), (3, 12, 16))],
)
def test_maps_that_do_not_fit_together_are_refused(
    heat: tuple[int, ...], edges: tuple[int, ...]
) -> None:
    with pytest.raises(ValueError, match="output adapter"):
        decode(np.zeros(heat, np.float32), np.zeros(edges, np.float32), stride_px=STRIDE_PX)


def test_a_network_gone_wrong_is_told_and_finds_nothing() -> None:
    heat, edges = maps((0, 5, 5, 0.9))
    edges[2, 5, 5] = np.nan
    with pytest.raises(ValueError, match="box is not finite"):
        decode(heat, edges, stride_px=STRIDE_PX)
    heat[1, 0, 0] = np.inf
    with pytest.raises(ValueError, match="heat has values that are not finite"):
        decode(heat, edges, stride_px=STRIDE_PX)


def test_overlap_is_shared_area_over_common_area() -> None:
    box = np.array([0, 0, 10, 10], np.float32)
    others = np.array([[0, 0, 10, 10], [5, 0, 15, 10], [20, 20, 30, 30]], np.float32)

    assert overlap(box, others).tolist() == pytest.approx([1.0, 1 / 3, 0.0])
