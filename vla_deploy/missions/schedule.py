"""Say when a mission begins: at once, later, again and again, or on a condition."""

import re
from collections.abc import Callable
from datetime import datetime, timedelta
from typing import Final

from pydantic import BaseModel, ConfigDict, Field

from vla_deploy.missions.errors import MissionInvalid

SHORTEST_PERIOD_S: Final = 10.0
LONGEST_WAIT_S: Final = 7 * 24 * 3600.0
_UNITS_S: Final = {"second": 1.0, "minute": 60.0, "hour": 3600.0, "day": 86400.0}
_NUMBERS: Final = {
    "zero": 0.0, "one": 1.0, "two": 2.0, "three": 3.0, "four": 4.0, "five": 5.0, "six": 6.0,
    "seven": 7.0, "eight": 8.0, "nine": 9.0, "ten": 10.0, "eleven": 11.0, "twelve": 12.0,
    "a": 1.0, "an": 1.0, "half an": 0.5, "fifteen": 15.0, "twenty": 20.0, "thirty": 30.0,
}  # fmt: skip
_AMOUNT: Final = (
    rf"(?P<number>\d+(?:\.\d+)?|{'|'.join(sorted(_NUMBERS, key=len, reverse=True))}) "
    r"(?P<unit>second|minute|hour|day)s?"
)
_HOUR: Final = (
    r"(?P<hour>\d{1,2}|" + "|".join(_NUMBERS) + r")(?::(?P<minute>\d{2}))?"
    r"(?: ?(?P<half>a\.?m\.?|p\.?m\.?)| o'?clock)?"
)
_EVERY: Final = re.compile(rf"every (?:(?P<unit0>second|minute|hour|day)|{_AMOUNT})")
_IN: Final = re.compile(rf"in {_AMOUNT}")
_AT: Final = re.compile(rf"at {_HOUR}")
_LOOKS: Final = re.compile(r"\b(?:look|gaze|glance|point|stare)$", re.IGNORECASE)  # "at one"
_WHEN: Final = re.compile(r"(?:as soon as|when|once) (?P<condition>.+)")


class MissionSchedule(BaseModel):
    """Say when a mission begins; without anything, at once.

    `at_unix_s` is the first time, `every_s` how long from one beginning to the next, at most
    `times` times; `when` is a criterion that has to be met.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    at_unix_s: float | None = Field(default=None, allow_inf_nan=False)
    every_s: float | None = Field(default=None, ge=SHORTEST_PERIOD_S, le=LONGEST_WAIT_S)
    times: int | None = Field(default=None, ge=1, le=1000)
    when: str = ""

    @property
    def is_at_once(self) -> bool:
        """Return whether it begins at once, and once."""
        return self == MissionSchedule()


def split_schedule(text: str, now: datetime) -> tuple[str, MissionSchedule]:
    """Return words without what they say of the time at their beginning or end, and that.

    Raises:
        MissionInvalid: the time is in the past, or repeats too often.
    """
    said = " ".join(text.split()).strip(" .!")
    for read in (_first_part, _last_part):
        if found := read(said, now):
            return found
    return said, MissionSchedule()


def _first_part(said: str, now: datetime) -> tuple[str, MissionSchedule] | None:
    head, comma, rest = said.partition(",")
    schedule = _schedule_of(head.strip(), now) if comma else None
    if schedule is None:
        return None
    rest = re.sub(r"^\s*then\s+", "", rest.strip(), flags=re.IGNORECASE)
    return (rest, schedule) if rest else None


def _last_part(said: str, now: datetime) -> tuple[str, MissionSchedule] | None:
    for found in re.finditer(r",? (?=(?:every|at|in) )", said, re.IGNORECASE):
        schedule = _schedule_of(said[found.end() :], now, with_condition=False)
        if schedule is not None and not _LOOKS.search(said[: found.start()]):
            return said[: found.start()], schedule
    return None


def _schedule_of(
    said: str, now: datetime, *, with_condition: bool = True
) -> MissionSchedule | None:
    words = said.lower()
    readings: list[tuple[re.Pattern[str], Callable[[re.Match[str]], MissionSchedule]]] = [
        (_EVERY, _every),
        (_IN, lambda found: MissionSchedule(at_unix_s=now.timestamp() + _amount_s(found))),
        (_AT, lambda found: MissionSchedule(at_unix_s=_time_of_day(found, now).timestamp())),
    ]
    if with_condition:
        readings.append((_WHEN, lambda found: MissionSchedule(when=found["condition"])))
    for pattern, read in readings:
        if found := pattern.fullmatch(words):
            return read(found)
    return None


def _every(found: re.Match[str]) -> MissionSchedule:
    period_s = _UNITS_S[found["unit0"]] if found["unit0"] else _amount_s(found)
    if not SHORTEST_PERIOD_S <= period_s <= LONGEST_WAIT_S:
        raise MissionInvalid(
            [f"repeated every {period_s:g} s, expected {SHORTEST_PERIOD_S:g} s to 7 days"]
        )
    return MissionSchedule(every_s=period_s)


def _amount_s(found: re.Match[str]) -> float:
    number = found["number"]
    return (_NUMBERS[number] if number in _NUMBERS else float(number)) * _UNITS_S[found["unit"]]


def _time_of_day(found: re.Match[str], now: datetime) -> datetime:
    """Return the next time that a clock shows so; without am or pm, of the next twelve hours."""
    word = found["hour"]
    hour, minute = int(_NUMBERS.get(word, -1)), int(found["minute"] or 0)
    hour = int(word) if hour < 0 else hour
    if hour > 24 or minute > 59:
        raise MissionInvalid([f'"{found[0]}" is no time of the day'])
    half = (found["half"] or "").replace(".", "")
    if half:
        hour = hour % 12 + (12 if half == "pm" else 0)
    at = now.replace(hour=hour % 24, minute=minute, second=0, microsecond=0)
    step = timedelta(hours=12 if not half and hour <= 12 and not found["minute"] else 24)
    while at <= now:
        at += step
    return at


def check_schedule(schedule: MissionSchedule, now_unix_s: float) -> None:
    """Accept a schedule that lies ahead.

    Raises:
        MissionInvalid: it begins in the past, or too far ahead.
    """
    if schedule.at_unix_s is None:
        return
    ahead_s = schedule.at_unix_s - now_unix_s
    if ahead_s < -1.0:
        raise MissionInvalid([f"it was to begin {-ahead_s:.0f} s ago; give a time that is to come"])
    if ahead_s > LONGEST_WAIT_S:
        raise MissionInvalid([f"it begins in {ahead_s / 86400:.0f} days, expected 7 at most"])
