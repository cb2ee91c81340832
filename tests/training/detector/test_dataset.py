from collections.abc import Iterator

import numpy as np
import pytest

from sim_twin.pictures.renderer import GLContext, open_gl_context
from training.detector.classes import CLASSES
from training.detector.dataset import draw_shard
from training.detector.scenes.drawing import HEIGHT_PX, WIDTH_PX

pytestmark = pytest.mark.gl


@pytest.fixture(scope="module")
def gl() -> Iterator[GLContext]:
    context = open_gl_context(WIDTH_PX, HEIGHT_PX)
    yield context
    context.free()


def test_the_same_seed_draws_the_same_images_and_labels(gl: GLContext) -> None:
    first, again = (draw_shard(gl, "train", 5, 7, count=3) for _ in range(2))

    assert np.array_equal(first.images, again.images)
    assert np.array_equal(first.labels, again.labels)


def test_no_split_shows_what_another_does(gl: GLContext) -> None:
    train, heldout = (draw_shard(gl, split, 5, 7, count=1) for split in ("train", "heldout"))

    assert not np.array_equal(train.images, heldout.images)


@pytest.mark.parametrize("split", ["train", "heldout", "flat"])
def test_labels_are_boxes_inside_the_image_of_known_classes(gl: GLContext, split: str) -> None:
    shard = draw_shard(gl, split, 2, 0, count=6)

    image, index, left, top, right, bottom, judged = shard.labels.T
    assert shard.images.shape == (6, HEIGHT_PX, WIDTH_PX, 3)
    assert judged.sum() >= 6
    assert ((left < right) & (top < bottom) & (left >= 0) & (top >= 0)).all()
    assert right.max() <= WIDTH_PX
    assert bottom.max() <= HEIGHT_PX
    assert set(index) <= set(range(-1, len(CLASSES)))
    assert (np.diff(image) >= 0).all()
