"""Make up lengths, angles and durations as people say them, in digits and in words."""

from random import Random
from typing import Final

from training.planner.sentences.lists import read_lists

Word = tuple[str, bool]
_AMOUNTS: Final = read_lists("amounts")
_ONES: Final = _AMOUNTS["ones"]
_TENS: Final = _AMOUNTS["tens"]
_METRES: Final = ("meters", "metres", "meter", "metre", "m")
_CENTIMETRES: Final = ("centimeters", "centimetres", "centimeter", "cm", "centimetre")


def spelt(number: int) -> str:
    """Return a number from 0 to 999 in words.

    Raises:
        IndexError: it is larger.
    """
    if number < 20:
        return _ONES[number]
    if number < 100:
        tens, ones = divmod(number, 10)
        return f"{_TENS[tens]} {_ONES[ones]}" if ones else _TENS[tens]
    hundreds, rest = divmod(number, 100)
    head = f"{_ONES[hundreds]} hundred"
    return f"{head} {spelt(rest)}" if rest else head


def length(random: Random) -> list[Word]:
    """Return a length."""
    if random.random() < 0.3:
        return _all(random.choice(_AMOUNTS["lengths"]))
    if random.random() < 0.5:
        return _all(f"{_number(random, random.randint(1, 5), whole=0.5)} {random.choice(_METRES)}")
    return _all(f"{_number(random, random.randint(1, 200))} {random.choice(_CENTIMETRES)}")


def angle(random: Random) -> list[Word]:
    """Return an angle."""
    if random.random() < 0.25:
        return _all(random.choice(_AMOUNTS["angles"]))
    value = random.choice(
        (15, 30, 45, 60, 90, 90, 90, 120, 135, 180, 270, 360, random.randint(1, 360))
    )
    return _all(
        f"{_number(random, value)} {random.choice(('degrees', 'degrees', 'degree', 'deg'))}"
    )


def duration(random: Random) -> list[Word]:
    """Return a length of time."""
    if random.random() < 0.3:
        return _all(random.choice(_AMOUNTS["times"]))
    unit = random.choice(
        ("seconds", "seconds", "seconds", "minutes", "sec", "secs", "s", "second", "minute")
    )
    return _all(
        f"{_number(random, random.choice((random.randint(1, 12), random.randint(1, 90))))} {unit}"
    )


def _number(random: Random, value: int, whole: float = 0.9) -> str:
    if random.random() > whole:
        return random.choice((f"{value}.{random.randint(1, 9)}", f"0.{random.randint(1, 99)}",
                              f"{spelt(value)} point {_ONES[random.randint(0, 9)]}",
                              f"zero point {_ONES[random.randint(1, 9)]}"))  # fmt: skip
    return spelt(value) if random.random() < 0.6 else str(value)


def _all(text: str) -> list[Word]:
    return [(word, True) for word in text.split()]
