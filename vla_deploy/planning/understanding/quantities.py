"""Read quantities as people and models write them: "50 cm", "half a meter", "a bit".

A unit may be one of measure or a vague one ("a bit"); the parameter's name says in which dimension.
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
_VALUES: Final[Mapping[str, float]] = MappingProxyType(
    {
        **{word: float(value) for value, word in enumerate(_ONES)},
        **{word: 10.0 * value for value, word in enumerate(_TENS, start=2)},
        "fourty": 40.0, "couple": 2.0, "few": 3.0, "half": 0.5, "quarter": 0.25, "a": 1.0,
        "an": 1.0,
    }
)  # fmt: skip
_SHARES: Final = frozenset({"half", "quarter"})
# "Right" is of a right angle, "width" of a hand's width.
_SILENT: Final = frozenset(
    {"of", "the", "about", "around", "by", "for", "exactly", "and", "full", "right", "width"}
)
_DEGREE: Final = math.pi / 180.0
UNITS: Final[Mapping[str, Mapping[str, float]]] = MappingProxyType(
    {
        "m": {
            "m": 1.0, "meter": 1.0, "metre": 1.0, "cm": 0.01, "centimeter": 0.01,
            "centimetre": 0.01, "mm": 0.001, "millimeter": 0.001, "millimetre": 0.001,
            "foot": 0.3048, "feet": 0.3048, "inch": 0.0254, "inche": 0.0254, "yard": 0.9144,
            "step": 0.3, "pace": 0.5, "hand": 0.1, "bit": 0.2, "little": 0.2, "tiny": 0.1,
            "touch": 0.1, "slightly": 0.1, "some": 0.3, "further": 0.3, "more": 0.3, "km": 1000.0,
            "kilometer": 1000.0, "kilometre": 1000.0, "mile": 1609.344,
        },
        "rad": {
            "degree": _DEGREE, "deg": _DEGREE, "°": _DEGREE, "radian": 1.0, "rad": 1.0,
            "turn": 2 * math.pi, "circle": 2 * math.pi, "rotation": 2 * math.pi, "way": 2 * math.pi,
            "halfway": math.pi, "angle": 0.5 * math.pi, "bit": 20 * _DEGREE, "little": 20 * _DEGREE,
            "tiny": 10 * _DEGREE, "slightly": 15 * _DEGREE, "completely": 2 * math.pi,
            "once": 2 * math.pi,
        },
        "s": {
            "s": 1.0, "sec": 1.0, "second": 1.0, "ms": 0.001, "millisecond": 0.001, "min": 60.0,
            "minute": 60.0, "h": 3600.0, "hour": 3600.0, "moment": 3.0, "bit": 5.0, "little": 5.0,
            "while": 10.0, "short": 5.0,
        },
        "m_s": {"m/s": 1.0, "mps": 1.0, "cm/s": 0.01, "km/h": 1 / 3.6, "kmh": 1 / 3.6,
                "mph": 0.44704},
    }
)  # fmt: skip
_FIGURES: Final = r"\d{1,6}(?:[.,]\d{1,4})?"
_NUMBER_WORD: Final = "|".join(
    sorted((*_VALUES, "a couple of", "a few", "hundred"), key=len, reverse=True)
)
NUMBER: Final = rf"(?:{_FIGURES}|(?:{_NUMBER_WORD})(?:[ -](?:and )?(?:{_NUMBER_WORD}))*)"
"""A number, in figures or words, before a unit."""
_TOKEN: Final = re.compile(r"-?\d+(?:[.,]\d+)?|[a-z/]+|\S")
_FIGURES_OR_WORD: Final = re.compile(r"\d+(?:[.,]\d+)?|[a-z]+")


def numbers_in(text: str) -> tuple[float, ...]:
    """Return the numbers of a sentence in their order, in figures or as words that name one."""
    values = {word: value for word, value in _VALUES.items() if word not in ("a", "an")}
    tokens = _FIGURES_OR_WORD.findall(text.lower())
    return tuple(
        values[token] if token in values else float(token.replace(",", "."))
        for token in tokens
        if token in values or token[0].isdigit()
    )


def quantity_of(text: str, dimension: str) -> float | None:
    """Return "50 cm" in SI units of a dimension ("m", "rad", "s", "m_s"), or None.

    A number without a unit is in the dimension's own.
    """
    return amount_of(quantity_words(text), UNITS[dimension], bare=1.0)


def quantity_words(text: str) -> list[str]:
    """Return the words and figures of a quantity: "50cm" is two."""
    return _TOKEN.findall(re.sub(r"-(?=[a-z])", " ", text.lower()))


def amount_of(
    words: Sequence[str], units: Mapping[str, float], bare: float | None = None
) -> float | None:
    """Return an amount in SI units, or None where the words are none.

    `bare` is the unit of a number that stands alone; without it such a number is no amount.
    """
    before: list[str] = []
    behind: list[str] = []
    factors: list[float] = []
    for word in words:
        factor = _unit(word, units)
        if factor is not None:
            factors.append(factor)
        elif _is_number(word):
            (behind if factors else before).append(word)
        elif word not in _SILENT:
            return None
    value = _number(before) if before else 1.0
    extra = _number(behind) if behind else 0.0  # "a minute and a half"
    if value is None or extra is None:
        return None
    if factors:
        return (value + extra) * min(factors)
    if not before:
        return None
    # "a quarter" and "half" of nothing else are of a whole turn.
    alone = units["turn"] if before[-1] in _SHARES and "turn" in units else bare
    return None if alone is None else value * alone


def amount_words(words: Sequence[str], units: Mapping[str, float]) -> list[str]:
    """Return those of some words that an amount may be made of.

    None are, where others have digits, or where nothing says how many.
    """
    own = [word for word in words if _is_number(word) or _unit(word, units) is not None]
    is_odd = any(one.isdigit() for word in words if word not in own for one in word)
    return own if any(map(_is_number, own)) and not is_odd else []


def is_silent(words: Sequence[str]) -> bool:
    """Tell whether words beside an amount are all there is: "about", "right around"."""
    return all(word in _SILENT for word in words)


def _unit(word: str, units: Mapping[str, float]) -> float | None:
    """Return what a unit is in SI units, also in the plural or as "a hand's width"."""
    forms = (word, word.removesuffix("s"), word.removesuffix("'s"))
    return next((units[form] for form in forms if form in units), None)


def _is_number(word: str) -> bool:
    return word in _VALUES or word in ("hundred", "thousand", "point") or _figure(word) is not None


def _figure(word: str) -> float | None:
    is_figure = re.fullmatch(rf"-?{_FIGURES}", word) is not None
    return float(word.replace(",", ".")) if is_figure else None


def _number(words: Sequence[str]) -> float | None:
    """Return the value of a number in figures or in words, or None."""
    if "point" in words:
        return _decimal(list(words))
    total, part, is_counted = 0.0, 0.0, False
    for word in words:
        if word in ("a", "an"):  # "half a meter" and "a half" leave the value to the other word
            continue
        if word == "hundred":
            part = (part if is_counted else 1.0) * 100.0
        elif word == "thousand":
            total, part = total + (part if is_counted else 1.0) * 1000.0, 0.0
        elif word in _VALUES:
            part += _VALUES[word]
        elif (figure := _figure(word)) is not None and not is_counted:
            part = figure
        else:
            return None
        is_counted = True
    return total + part if is_counted else 1.0


def _decimal(words: list[str]) -> float | None:
    """Return "two point five": digits behind the point, one a word."""
    at = words.index("point")
    whole = _number(words[:at]) if at else 0.0
    digits = [_ONES.index(one) if one in _ONES[:10] else one for one in words[at + 1 :]]
    text = "".join(map(str, digits))
    if whole is None or not text.isdecimal():
        return None
    return whole + float(f"0.{text}")
