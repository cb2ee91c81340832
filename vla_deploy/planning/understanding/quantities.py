"""Read quantities as people and models write them: "50 cm", "90 degrees", "half a minute"."""

import math
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

NUMBER_WORDS: Final[Mapping[str, float]] = MappingProxyType(
    {
        "a": 1, "an": 1, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6,
        "seven": 7, "eight": 8, "nine": 9, "ten": 10, "eleven": 11, "twelve": 12, "fifteen": 15,
        "twenty": 20, "thirty": 30, "forty": 40, "forty five": 45, "fortyfive": 45, "fifty": 50,
        "sixty": 60, "seventy": 70, "eighty": 80, "ninety": 90, "hundred": 100,
        "a hundred": 100, "one hundred": 100,
        "one hundred and eighty": 180, "half": 0.5, "half a": 0.5, "half an": 0.5,
        "a half": 0.5, "a quarter": 0.25, "quarter": 0.25, "a couple of": 2, "a few": 3,
        "one and a half": 1.5, "two and a half": 2.5,
    }
)  # fmt: skip
_DEGREE: Final = math.pi / 180.0
# Every unit by its names; the parameter's name says which dimension it wants.
UNITS: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType(
    {
        "m": MappingProxyType(
            {"m": 1.0, "meter": 1.0, "metre": 1.0, "cm": 0.01, "centimeter": 0.01,
             "centimetre": 0.01, "mm": 0.001, "millimeter": 0.001, "millimetre": 0.001,
             "foot": 0.3048, "feet": 0.3048, "inch": 0.0254, "inches": 0.0254, "step": 0.3,
             "pace": 0.5, "yard": 0.9144}
        ),
        "rad": MappingProxyType(
            {"rad": 1.0, "radian": 1.0, "deg": _DEGREE, "degree": _DEGREE, "°": _DEGREE,
             "turn": 2 * math.pi, "circle": 2 * math.pi}
        ),
        "s": MappingProxyType(
            {"s": 1.0, "sec": 1.0, "second": 1.0, "ms": 0.001, "millisecond": 0.001,
             "min": 60.0, "minute": 60.0, "moment": 2.0, "h": 3600.0, "hour": 3600.0}
        ),
        "m_s": MappingProxyType(
            {"m/s": 1.0, "mps": 1.0, "cm/s": 0.01, "km/h": 1 / 3.6, "kmh": 1 / 3.6, "mph": 0.44704}
        ),
    }
)  # fmt: skip
_WORDS: Final = "|".join(
    re.escape(word).replace(r"\ ", r"[ -]") for word in sorted(NUMBER_WORDS, key=len, reverse=True)
)
# A number, in figures or words, before a unit.
NUMBER: Final = rf"(?:\d{{1,6}}(?:[.,]\d{{1,4}})?|{_WORDS})"
_QUANTITY: Final = re.compile(rf"(?P<number>-?{NUMBER})\s*(?:of a |an? )?(?P<unit>[a-z/°]*)")


_SPOKEN: Final[Mapping[str, float]] = MappingProxyType(
    {
        **{word: value for word, value in NUMBER_WORDS.items() if " " not in word},
        "zero": 0, "thirteen": 13, "fourteen": 14, "sixteen": 16, "seventeen": 17, "eighteen": 18,
        "nineteen": 19,
    }
)  # fmt: skip
_ARTICLES: Final = frozenset({"a", "an"})
_FIGURES_OR_WORD: Final = re.compile(r"\d+(?:[.,]\d+)?|[a-z]+")


def numbers_in(text: str) -> tuple[float, ...]:
    """Return the numbers of a sentence in their order, in figures or as words that name one."""
    tokens = _FIGURES_OR_WORD.findall(text.lower())
    return tuple(
        _SPOKEN[token] if token in _SPOKEN else float(token.replace(",", "."))
        for token in tokens
        if token not in _ARTICLES and (token in _SPOKEN or token[0].isdigit())
    )


def number_of(words: str) -> float | None:
    """Return the value of a number in figures or in words, or None."""
    spoken = words.strip().replace("-", " ") if not words.strip().startswith("-") else words
    if spoken in NUMBER_WORDS:
        return NUMBER_WORDS[spoken]
    try:
        value = float(spoken.replace(",", "."))
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def quantity_of(text: str, dimension: str) -> float | None:
    """Return "50 cm" in SI units of a dimension ("m", "rad", "s", "m_s"), or None.

    A number without a unit is in the dimension's own.
    """
    found = _QUANTITY.fullmatch(text.strip().lower())
    if found is None:
        return None
    value, unit = number_of(found["number"]), found["unit"]
    units = UNITS[dimension]
    scale = units.get(unit, units.get(unit.removesuffix("s"))) if unit else 1.0
    return None if value is None or scale is None else value * scale
