"""Write numbers of several words in figures, so that no "and" in them parts a sentence."""

import re
from collections.abc import Callable
from typing import Final

from vla_deploy.planning.understanding.quantities import NUMBER, UNITS, number_of

_PART: Final = r"(?P<part>half|quarter)"
_PARTS: Final = {"half": 0.5, "quarter": 0.25}
_UNIT: Final = "|".join(
    sorted({f"{unit}s?" for units in UNITS.values() for unit in units if unit.isalpha()}, key=len,
           reverse=True)
)  # fmt: skip
_HUNDREDS: Final = re.compile(
    r"\b(?P<count>a|one|two|three) hundred"
    rf"(?:(?: and)? (?P<rest>(?!an? |half|quarter){NUMBER})(?![a-z]))?(?= |$)(?! and )"
)
_BEFORE_UNIT: Final = re.compile(rf"\b(?P<number>{NUMBER}) and an? {_PART}\b")
_BEHIND_UNIT: Final = re.compile(rf"\b(?P<number>{NUMBER}) (?P<unit>{_UNIT}) and an? {_PART}\b")
_QUARTERS: Final = re.compile(r"\bthree[ -]quarters of an? (?=" + _UNIT + r"\b)(?!turn|circle)")


def in_figures(text: str) -> str:
    """Return "2.5 metres" for "two and a half metres", "180" for "one hundred and eighty"."""
    if " and a " not in text and "hundred" not in text and "quarters" not in text:
        return text
    for pattern, written in _WRITTEN:
        text = pattern.sub(written, text)
    return text


def _hundreds(found: re.Match[str]) -> str:
    rest = 0.0 if found["rest"] is None else number_of(found["rest"])
    count = number_of(found["count"])
    return found[0] if count is None or rest is None else f"{100 * count + rest:g}"


def _before(found: re.Match[str]) -> str:
    number = number_of(found["number"])
    return found[0] if number is None else f"{number + _PARTS[found['part']]:g}"


def _behind(found: re.Match[str]) -> str:
    number = number_of(found["number"])
    return found[0] if number is None else f"{number + _PARTS[found['part']]:g} {found['unit']}"


_WRITTEN: Final[tuple[tuple[re.Pattern[str], Callable[[re.Match[str]], str]], ...]] = (
    (_HUNDREDS, _hundreds),
    (_BEHIND_UNIT, _behind),
    (_BEFORE_UNIT, _before),
    (_QUARTERS, lambda _: "0.75 "),
)
