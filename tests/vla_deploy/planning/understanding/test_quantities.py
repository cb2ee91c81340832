"""Amounts as people say them, in digits, in words, and vague ones by a written rule."""

import math

import pytest

from vla_deploy.planning.understanding.quantities import UNITS, amount_of, quantity_of

_DEGREE = math.pi / 180.0


@pytest.mark.parametrize(
    ("words", "dimension", "expected"),
    [
        ("two meters", "m", 2.0),
        ("half a metre", "m", 0.5),
        ("one and a half meters", "m", 1.5),
        ("zero point five m", "m", 0.5),
        ("1.5", "m", 1.5),
        ("one hundred sixty eight centimetres", "m", 1.68),
        ("ten inches", "m", 0.254),
        ("a couple of steps", "m", 0.6),
        ("a bit", "m", 0.2),
        ("ninety degrees", "rad", 90 * _DEGREE),
        ("one hundred twenty degrees", "rad", 120 * _DEGREE),
        ("180", "rad", math.pi),
        ("a quarter turn", "rad", 0.5 * math.pi),
        ("half", "rad", math.pi),
        ("a full circle", "rad", 2 * math.pi),
        ("a right angle", "rad", 0.5 * math.pi),
        ("five seconds", "s", 5.0),
        ("half a minute", "s", 30.0),
        ("a minute and a half", "s", 90.0),
        ("two point five seconds", "s", 2.5),
    ],
)
def test_amounts_are_read(words: str, dimension: str, expected: float) -> None:
    units = UNITS[dimension]
    bare = units["degree"] if dimension == "rad" else 1.0
    assert amount_of(words.split(), units, bare) == pytest.approx(expected)


@pytest.mark.parametrize(
    "words", ["blue", "two kitchens", "point", "", "rope of five metres", "5 3"]
)
def test_other_words_are_no_amount(words: str) -> None:
    assert amount_of(words.split(), UNITS["s"], 1.0) is None


@pytest.mark.parametrize(
    ("text", "dimension", "expected"),
    [
        ("50 cm", "m", 0.5),
        ("50cm", "m", 0.5),
        ("-0,5", "m", -0.5),
        ("forty-five degrees", "rad", math.radians(45)),
        ("90°", "rad", math.pi / 2),
        ("1.2 rad", "rad", 1.2),
        ("half a minute", "s", 30.0),
        ("0.3 m/s", "m_s", 0.3),
        ("nan", "m", None),
        ("2 m!", "m", None),
        ("1234567 8 m", "m", None),
        ("five kg", "m", None),
    ],
)
def test_quantities_are_read_in_the_dimension_of_a_parameter(
    text: str, dimension: str, expected: float | None
) -> None:
    assert quantity_of(text, dimension) == (None if expected is None else pytest.approx(expected))
