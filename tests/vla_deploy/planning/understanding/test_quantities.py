"""Amounts as people say them, in digits, in words, and vague ones by a written rule."""

import math

import pytest

from vla_deploy.planning.understanding.quantities import UNITS, amount_of, quantity_words


def amount(text: str, dimension: str) -> float | None:
    units = UNITS[dimension]
    return amount_of(quantity_words(text), units, units.get("degree", 1.0))


@pytest.mark.parametrize(
    ("text", "dimension", "expected"),
    [
        ("two meters", "m", 2.0),
        ("half a metre", "m", 0.5),
        ("one and a half meters", "m", 1.5),
        ("1.5", "m", 1.5),
        ("50cm", "m", 0.5),
        ("-0,5", "m", -0.5),
        ("one hundred sixty eight centimetres", "m", 1.68),
        ("ten inches", "m", 0.254),
        ("a couple of steps", "m", 0.6),
        ("a little bit", "m", 0.2),
        ("forty-five degrees", "rad", math.radians(45)),
        ("90°", "rad", math.pi / 2),
        ("one hundred twenty degrees", "rad", math.radians(120)),
        ("180", "rad", math.pi),
        ("a quarter turn", "rad", 0.5 * math.pi),
        ("a full circle", "rad", 2 * math.pi),
        ("a right angle", "rad", 0.5 * math.pi),
        ("about five seconds", "s", 5.0),
        ("half a minute", "s", 30.0),
    ],
)
def test_amounts_are_read(text: str, dimension: str, expected: float) -> None:
    assert amount(text, dimension) == pytest.approx(expected)


@pytest.mark.parametrize(
    "text",
    ["blue", "two kitchens", "rope of five metres", "5 3", "two three metres", "one half metre",
     "two point five metres", "a metre and a half", "half", "nan", "2 m!", "1234567 8 m"],
)  # fmt: skip
def test_other_words_are_no_amount(text: str) -> None:
    assert amount(text, "m") is None
