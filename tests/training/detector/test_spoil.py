import numpy as np
import pytest

from training.detector.scenes.spoil import spoil


def spoiled(level: int) -> np.ndarray:
    """Return many spoiled images of one even grey, as mean levels."""
    image = np.full((24, 32, 3), level, np.uint8)
    return np.array([spoil(image, np.random.default_rng(seed)).mean() for seed in range(40)])


def test_a_dark_room_is_exposed_until_it_can_be_seen() -> None:
    assert spoiled(20).min() > 30


def test_what_is_bright_enough_is_not_made_brighter_when_left_clean() -> None:
    assert np.isclose(spoiled(120), 120).any()


@pytest.mark.parametrize("level", [0, 255])
def test_an_image_of_nothing_stays_an_image(level: int) -> None:
    means = spoiled(level)

    assert ((means >= 0) & (means <= 255)).all()
