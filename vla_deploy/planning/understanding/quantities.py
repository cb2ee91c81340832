"""Read quantities as people say them: "50 cm", "half a meter", "a bit".

A unit may be one of measure or a vague one ("a bit").
"""

import math
import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

_ONES: Final = (
    "zero", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven",
    "twelve", "thirteen", "fourteen", "fifteen", "sixteen", "seventeen", "eighteen", "nineteen",
)  # fmt: skip
_TENS: Final = ("twenty", "thirty", "forty", "fifty", "sixty", "seventy", "eighty", "ninety")
_SHARES: Final = {"half": 0.5, "quarter": 0.25}
_VALUES: Final[Mapping[str, float]] = MappingProxyType(
    {
        **{word: float(value) for value, word in enumerate(_ONES)},
        **{word: 10.0 * value for value, word in enumerate(_TENS, start=2)},
        **_SHARES, "couple": 2.0, "few": 3.0,
    }
)  # fmt: skip
# "Right" is of a right angle.
_SILENT: Final = frozenset(
    {"a", "an", "of", "the", "about", "around", "by", "for", "exactly", "full", "right", "tiny",
     "more", "further"}
)  # fmt: skip
_DEGREE: Final = math.pi / 180.0
UNITS: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType(
    {
        "m": {
            "m": 1.0, "meter": 1.0, "metre": 1.0, "cm": 0.01, "centimeter": 0.01,
            "centimetre": 0.01, "mm": 0.001, "foot": 0.3048, "feet": 0.3048, "inch": 0.0254,
            "inche": 0.0254, "step": 0.3, "bit": 0.2, "little": 0.2, "slightly": 0.1,
        },
        "rad": {
            "degree": _DEGREE, "deg": _DEGREE, "°": _DEGREE, "radian": 1.0, "rad": 1.0,
            "turn": 2 * math.pi, "circle": 2 * math.pi, "angle": 0.5 * math.pi,
            "bit": 20 * _DEGREE, "little": 20 * _DEGREE, "slightly": 15 * _DEGREE,
            "once": 2 * math.pi,
        },
        "s": {
            "s": 1.0, "sec": 1.0, "second": 1.0, "min": 60.0, "minute": 60.0, "h": 3600.0,
            "hour": 3600.0, "moment": 3.0, "bit": 5.0, "little": 5.0, "while": 10.0,
        },
    }
)  # fmt: skip
_FIGURES: Final = r"\d{1,6}(?:[.,]\d{1,4})?"
_NUMBER_WORD: Final = "|".join(
    sorted((*_VALUES, "a", "an", "a couple of", "a few", "hundred"), key=len, reverse=True)
)
NUMBER: Final = rf"(?:{_FIGURES}|(?:{_NUMBER_WORD})(?:[ -](?:and )?(?:{_NUMBER_WORD}))*)"
"""A number, in figures or words, before a unit."""
_TOKEN: Final = re.compile(r"-?\d+(?:[.,]\d+)?|[a-z]+|\S")
_FIGURES_OR_WORD: Final = re.compile(r"\d+(?:[.,]\d+)?|[a-z]+")


def numbers_in(text: str) -> tuple[float, ...]:
    """Return the numbers of a sentence in their order, in figures or as words that name one."""
    return tuple(
        _VALUES[token] if token in _VALUES else float(token.replace(",", "."))
        for token in _FIGURES_OR_WORD.findall(text.lower())
        if token in _VALUES or token[0].isdigit()
    )


def quantity_words(text: str) -> list[str]:
    """Return the words and figures of a quantity that tell anything: "50cm" is two."""
    tokens = _TOKEN.findall(re.sub(r"-(?=[a-z])", " ", text.lower()))
    return [token for token in tokens if token not in _SILENT]


def amount_of(words: Sequence[str], units: Mapping[str, float], bare: float) -> float | None:
    """Return an amount in SI units, or None where the words are none.

    `bare` is the unit of a number that stands alone; of a share it is not known of what.
    """
    first = next((at for at, word in enumerate(words) if _unit(word, units)), len(words))
    factors = [_unit(word, units) for word in words[first:]]
    value = _number(words[:first])
    if value is None or not words or None in factors:
        return None
    if not factors:
        return None if words[-1] in _SHARES else value * bare
    return value * min(factor for factor in factors if factor is not None)


def _unit(word: str, units: Mapping[str, float]) -> float | None:
    """Return what a unit is in SI units, also in the plural."""
    return units.get(word, units.get(word.removesuffix("s")))


def _number(words: Sequence[str]) -> float | None:
    """Return the value of a number in figures or in words, one where there is none, or None."""
    if len(words) == 1 and re.fullmatch(rf"-?{_FIGURES}", words[0]):
        return float(words[0].replace(",", "."))
    total = 0.0
    for at, word in enumerate(words):
        value = _VALUES.get(word)
        # "A hundred sixty", "one and a half"; neither "two three" nor "one half".
        room = 100.0 if total % 100 == 0 else 10.0 if total % 10 == 0 else 1.0
        is_added = not total or word not in _SHARES or words[at - 1] == "and"
        if word == "hundred":
            total = 100.0 * (total or 1.0)
        elif value is not None and value < room and is_added:
            total += value
        elif word != "and":
            return None
    return total if words else 1.0
