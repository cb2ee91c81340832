import numpy as np
import pytest

from vla_deploy.perception.naming.colour import NAMES, colour_names, dominant_colour

PURE = {
    "red": (200, 15, 15),
    "orange": (240, 130, 20),
    "yellow": (240, 200, 20),
    "green": (20, 130, 50),
    "blue": (20, 50, 210),
    "purple": (130, 40, 150),
    "pink": (250, 150, 180),
    "brown": (110, 70, 35),
    "white": (240, 238, 232),
    "grey": (128, 128, 130),
    "black": (15, 15, 18),
}


DIM = {"pink": "red", "orange": "brown", "white": "grey"}


@pytest.mark.parametrize(("name", "rgb"), PURE.items())
def test_a_plain_colour_has_its_name(name: str, rgb: tuple[int, int, int]) -> None:
    assert name_of(rgb, light=1.0) == name


@pytest.mark.parametrize(("name", "rgb"), PURE.items())
def test_a_colour_keeps_its_name_in_dim_light_or_takes_its_darker_neighbours(
    name: str, rgb: tuple[int, int, int]
) -> None:
    assert name_of(rgb, light=0.7) in (name, DIM.get(name))


def name_of(rgb: tuple[int, int, int], light: float) -> str:
    pixels = (np.array([rgb]) * light).astype(np.uint8)
    return NAMES[int(colour_names(pixels)[0])]


def test_every_colour_has_a_name() -> None:
    axis = np.arange(0, 256, 15, dtype=np.uint8)
    pixels = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    names = colour_names(pixels)
    assert names.min() >= 0
    assert set(np.unique(names)) == set(range(len(NAMES)))


def test_the_commonest_colour_wins_with_its_share() -> None:
    pixels = np.array([PURE["red"]] * 7 + [PURE["white"]] * 3, dtype=np.uint8)
    assert dominant_colour(pixels) == ("red", 0.7)
