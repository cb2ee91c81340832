import numpy as np
import pytest

from training.detector.average_precision import judge
from training.detector.classes import CLASSES
from vla_deploy.perception.detectors.boxes import Boxes

CUP, CAN = CLASSES.index("cup"), CLASSES.index("can")
PLACE = (10.0, 10.0, 30.0, 30.0)
ELSEWHERE = (100.0, 100.0, 130.0, 120.0)


def boxes(*found: tuple[int, float, tuple[float, ...]]) -> Boxes:
    return Boxes(
        corners_px=np.array([edges for _, _, edges in found], np.float32).reshape(-1, 4),
        classes=np.array([index for index, _, _ in found], np.intp),
        scores=np.array([score for _, score, _ in found], np.float32),
    )


def labels(*rows: tuple[int, tuple[float, ...], int]) -> np.ndarray:
    table = [(0, index, *edges, judged) for index, edges, judged in rows]
    return np.array(table, np.float32).reshape(-1, 7)


def test_finding_everything_once_is_perfect() -> None:
    found = judge([boxes((CUP, 0.9, PLACE))], [labels((CUP, PLACE, 1))])["cup"]

    assert (found.ap50, found.ap75, found.recall, found.sure_recall) == (1, 1, 1, 1)
    assert (found.precision, found.labels) == (1, 1)


def test_a_second_box_on_the_same_thing_is_wrong() -> None:
    twice = boxes((CUP, 0.9, PLACE), (CUP, 0.8, PLACE))
    found = judge([twice], [labels((CUP, PLACE, 1))])["cup"]

    assert (found.ap50, found.precision) == (1.0, 0.5)


def test_a_false_box_surer_than_the_right_one_halves_the_precision() -> None:
    mixed = boxes((CUP, 0.9, ELSEWHERE), (CUP, 0.8, PLACE))

    assert judge([mixed], [labels((CUP, PLACE, 1))])["cup"].ap50 == 0.5


def test_the_wrong_class_is_no_find() -> None:
    found = judge([boxes((CAN, 0.9, PLACE))], [labels((CUP, PLACE, 1))])

    assert (found["cup"].ap50, found["cup"].recall, found["can"].precision) == (0.0, 0.0, 0.0)


def test_a_loose_box_hits_the_centre_and_misses_the_overlap() -> None:
    loose = boxes((CUP, 0.9, (8.0, 8.0, 44.0, 36.0)))
    found = judge([loose], [labels((CUP, PLACE, 1))])["cup"]

    assert (found.recall, found.ap50) == (1.0, 0.0)


@pytest.mark.parametrize(("score", "recall"), [(0.2, 1.0), (0.1, 0.0)])
def test_a_weak_box_is_no_sure_find_and_one_below_counts_for_average_precision_alone(
    score: float, recall: float
) -> None:
    found = judge([boxes((CUP, score, PLACE))], [labels((CUP, PLACE, 1))])["cup"]

    assert (found.ap50, found.recall, found.sure_recall) == (1.0, recall, 0.0)


@pytest.mark.parametrize("index", [CUP, -1])
def test_a_box_on_what_is_passed_over_is_neither_right_nor_wrong(index: int) -> None:
    both = boxes((CUP, 0.9, ELSEWHERE), (CUP, 0.8, PLACE))
    found = judge([both], [labels((CUP, PLACE, 1), (index, ELSEWHERE, 0))])["cup"]

    assert (found.ap50, found.precision, found.labels) == (1.0, 1.0, 1)
