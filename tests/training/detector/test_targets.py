import numpy as np
import pytest

from training.detector.classes import CLASSES
from training.detector.targets import STRIDE_PX, Targets, make_targets
from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.detectors.centre_net import decode

CUP, BOX = CLASSES.index("cup"), CLASSES.index("box")


def rows(*labels: tuple[int, int, int, int, int, int]) -> np.ndarray:
    """Return rows of (class, left, top, right, bottom, judged) of image 0."""
    return np.array([(0, *label) for label in labels], np.float32)


def heat(made: Targets) -> np.ndarray:
    """Return the heat of a network that knows the targets."""
    return np.stack([made.names == index for index in range(len(CLASSES))]).astype(np.float32)


def surest(made: Targets) -> Boxes:
    return decode(
        heat(made), made.edges, stride_px=STRIDE_PX, score_threshold=0.99, iou_threshold=0.5
    )


def test_what_the_maps_should_say_decodes_to_the_labels() -> None:
    made = make_targets(rows((CUP, 40, 60, 64, 90, 1), (BOX, 100, 20, 190, 110, 1)), 240, 320)

    boxes = surest(made)

    found = sorted(zip(boxes.classes.tolist(), boxes.corners_px.tolist(), strict=True))
    assert found == [(CUP, [40, 60, 64, 90]), (BOX, [100, 20, 190, 110])]


def test_a_thing_in_a_box_is_learnt_where_it_covers_the_box() -> None:
    made = make_targets(rows((CUP, 130, 50, 160, 80, 1), (BOX, 100, 20, 190, 110, 1)), 240, 320)

    boxes = surest(made)

    assert boxes.corners_px[boxes.classes == CUP].tolist() == [[130, 50, 160, 80]]


@pytest.mark.parametrize("index", [CUP, -1])
def test_what_is_hardly_seen_is_neither_right_nor_wrong(index: int) -> None:
    made = make_targets(rows((index, 40, 60, 64, 90, 0)), 240, 320)

    assert made.names.max() == -1
    assert made.ignored[7:12, 5:8].all()
    assert made.ignored.sum() == 5 * 3


def test_a_thing_between_the_middles_of_cells_is_learnt_all_the_same() -> None:
    made = make_targets(rows((CUP, 41, 65, 59, 71, 1)), 240, 320)

    assert surest(made).corners_px.tolist() == [[41, 65, 59, 71]]


def test_large_things_weigh_more_by_the_root_of_their_cells() -> None:
    small = make_targets(rows((CUP, 40, 64, 56, 80, 1)), 240, 320)
    large = make_targets(rows((CUP, 40, 60, 160, 200, 1)), 240, 320)

    cells = (large.names == CUP).sum() / (small.names == CUP).sum()
    assert cells > 1
    assert large.share.sum() / small.share.sum() == pytest.approx(cells**0.5)
