import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.perception.detectors.boxes import (
    MAX_BOXES,
    Boxes,
    iou,
    suppress_overlaps,
    valid_boxes,
)


def boxes(*rows: tuple[tuple[float, ...], float, int]) -> Boxes:
    return Boxes(
        corners_px=np.array([row[0] for row in rows], dtype=np.float32).reshape(-1, 4),
        scores=np.array([row[1] for row in rows], dtype=np.float32),
        classes=np.array([row[2] for row in rows], dtype=np.intp),
    )


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        ((0, 0, 10, 10), 1.0),
        ((5, 0, 15, 10), 1 / 3),
        ((0, 0, 5, 5), 0.25),
        ((10, 0, 20, 10), 0.0),
        ((20, 20, 30, 30), 0.0),
        ((3, 3, 3, 3), 0.0),
    ],
)
def test_overlap_is_what_both_cover_over_what_either_covers(other, expected):
    box, others = np.float32([0, 0, 10, 10]), np.array([other], dtype=np.float32)
    assert iou(box, others).tolist() == pytest.approx([expected])


def test_a_surer_box_takes_out_those_of_its_class_only():
    left = suppress_overlaps(
        boxes(
            ((0, 0, 10, 10), 0.9, 0),
            ((1, 0, 11, 10), 0.8, 1),
            ((0, 1, 10, 11), 0.7, 0),
            ((50, 0, 60, 10), 0.6, 0),
        ),
        0.5,
    )
    assert left.scores.tolist() == pytest.approx([0.9, 0.8, 0.6])


def test_a_box_that_was_taken_out_takes_none_out_itself():
    chain = [((4 * n, 0, 4 * n + 10, 10), 0.9 - 0.1 * n, 0) for n in range(3)]
    kept = suppress_overlaps(boxes(*chain), 0.4)
    assert kept.corners_px[:, 0].tolist() == [0, 8]


def test_unsure_empty_and_endless_boxes_are_left_out():
    found = valid_boxes(
        boxes(
            ((0, 0, 10, 10), 0.3, 0),
            ((0, 0, 10, 10), 0.2, 0),
            ((10, 0, 10, 10), 0.9, 0),
            ((0, 10, 10, 0), 0.9, 0),
            ((0, 0, np.inf, 10), 0.9, 0),
            ((0, 0, 10, 10), np.nan, 0),
            ((5, 5, 10, 10), 0.5, 0),
        ),
        0.25,
    )
    assert found.scores.tolist() == pytest.approx([0.5, 0.3])


def test_no_more_boxes_are_told_than_a_room_can_hold():
    many = boxes(*(((20 * n, 0, 20 * n + 10, 10), 0.9, 0) for n in range(MAX_BOXES + 50)))
    assert len(suppress_overlaps(many, 0.5)) == MAX_BOXES


def test_nothing_stays_nothing():
    assert len(suppress_overlaps(valid_boxes(boxes(), 0.1), 0.5)) == 0


CORNERS = st.tuples(*[st.integers(0, 30)] * 2, *[st.integers(1, 20)] * 2)


@given(st.lists(st.tuples(CORNERS, st.integers(0, 2)), max_size=12), st.floats(0.1, 0.9))
def test_what_is_kept_is_free_of_doubles_and_covers_what_is_not(rows, threshold):
    listed = [
        ((x, y, x + w, y + h), 1.0 - 0.01 * number, kind)
        for number, ((x, y, w, h), kind) in enumerate(rows)
    ]
    kept = suppress_overlaps(boxes(*listed), threshold)
    told = [tuple(one) for one in kept.corners_px.astype(int).tolist()]
    chosen = list(zip(told, kept.classes.tolist(), strict=True))
    for corners, _, kind in listed:
        overlaps = [
            float(iou(np.float32(corners), np.array([other], dtype=np.float32))[0])
            for other, its_kind in chosen
            if its_kind == kind
        ]
        assert any(one > threshold or one == pytest.approx(1.0) for one in overlaps)
    for number, (box, kind) in enumerate(chosen):
        for other, its_kind in chosen[:number]:
            pair = iou(np.float32(box), np.array([other], dtype=np.float32))[0]
            assert its_kind != kind or pair <= threshold
