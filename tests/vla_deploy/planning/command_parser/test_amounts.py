"""Amounts as people say them, in digits, in words, and vague ones by a written rule."""

import math
from collections.abc import Mapping

import pytest

from vla_deploy.planning.command_parser.amounts import METRES, RADIANS, SECONDS, amount_of

_DEGREE = math.pi / 180.0


@pytest.mark.parametrize(
    ("words", "units", "bare", "expected"),
    [
        ("two meters", METRES, "m", 2.0),
        ("half a metre", METRES, "m", 0.5),
        ("one and a half meters", METRES, "m", 1.5),
        ("zero point five m", METRES, "m", 0.5),
        ("1.5", METRES, "m", 1.5),
        ("one hundred sixty eight centimetres", METRES, "m", 1.68),
        ("ten inches", METRES, "m", 0.254),
        ("a couple of steps", METRES, "m", 0.6),
        ("a bit", METRES, "m", 0.2),
        ("ninety degrees", RADIANS, "degree", 90 * _DEGREE),
        ("one hundred twenty degrees", RADIANS, "degree", 120 * _DEGREE),
        ("180", RADIANS, "degree", math.pi),
        ("a quarter turn", RADIANS, "degree", 0.5 * math.pi),
        ("half", RADIANS, "degree", math.pi),
        ("a full circle", RADIANS, "degree", 2 * math.pi),
        ("a right angle", RADIANS, "degree", 0.5 * math.pi),
        ("five seconds", SECONDS, "second", 5.0),
        ("half a minute", SECONDS, "second", 30.0),
        ("a minute and a half", SECONDS, "second", 90.0),
        ("two point five seconds", SECONDS, "second", 2.5),
    ],
)
def test_amounts_are_read(
    words: str, units: Mapping[str, float], bare: str, expected: float
) -> None:
    assert amount_of(words.split(), units, bare) == pytest.approx(expected)


@pytest.mark.parametrize("words", ["blue", "two kitchens", "point", "", "meters of rope five"])
def test_other_words_are_no_amount(words: str) -> None:
    found = amount_of(words.split(), SECONDS, "second")
    assert found is None or words == ""
