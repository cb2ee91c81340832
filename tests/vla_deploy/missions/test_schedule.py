"""What words say of the time becomes a schedule, and the rest stays as it was said."""

from datetime import UTC, datetime, timedelta

import pytest

from vla_deploy.missions.errors import MissionInvalid
from vla_deploy.missions.schedule import MissionSchedule, check_schedule, split_schedule

NOW = datetime(2026, 5, 4, 15, 30, tzinfo=UTC)


def at(hour: int, minute: int = 0, days: int = 0) -> MissionSchedule:
    then = NOW.replace(hour=hour, minute=minute) + timedelta(days=days)
    return MissionSchedule(at_unix_s=then.timestamp())


def later(seconds: float) -> MissionSchedule:
    return MissionSchedule(at_unix_s=NOW.timestamp() + seconds)


@pytest.mark.parametrize(
    ("said", "rest", "schedule"),
    [
        ("go to the kitchen", "go to the kitchen", MissionSchedule()),
        ("every ten minutes, go to the kitchen", "go to the kitchen", MissionSchedule(every_s=600)),
        ("look around every hour", "look around", MissionSchedule(every_s=3600)),
        ("Go to the kitchen every 2.5 minutes.", "Go to the kitchen", MissionSchedule(every_s=150)),
        ("at seven, go to the kitchen", "go to the kitchen", at(19)),
        ("go to the kitchen at 7 o'clock", "go to the kitchen", at(19)),
        ("go to the kitchen at 7 am", "go to the kitchen", at(7, days=1)),
        ("go to the kitchen at 16:05", "go to the kitchen", at(16, 5)),
        ("go to the kitchen at 3:05 p.m.", "go to the kitchen", at(15, 5, days=1)),
        ("in five minutes, go to the kitchen", "go to the kitchen", later(300)),
        ("clean the table in half an hour", "clean the table", later(1800)),
        ("when the cup is on the table, go there", "go there",
         MissionSchedule(when="the cup is on the table")),
        # These say nothing of the time.
        ("look at one", "look at one", MissionSchedule()),
        ("put the cup in the box", "put the cup in the box", MissionSchedule()),
        ("wait at the kitchen", "wait at the kitchen", MissionSchedule()),
        ("at seven", "at seven", MissionSchedule()),
    ],
)  # fmt: skip
def test_words_of_time_become_a_schedule(said, rest, schedule) -> None:
    assert split_schedule(said, NOW) == (rest, schedule)


@pytest.mark.parametrize(
    ("said", "why"),
    [("every second, go home", "every 1 s"), ("go home at 25:00", "no time of the day")],
)
def test_a_time_that_is_none_is_named(said, why) -> None:
    with pytest.raises(MissionInvalid, match=why):
        split_schedule(said, NOW)


@pytest.mark.parametrize(
    ("ahead_s", "why"), [(-60.0, "60 s ago"), (20 * 86400.0, "in 20 days"), (60.0, None)]
)
def test_a_time_in_the_past_or_too_far_ahead_is_refused(ahead_s, why) -> None:
    schedule = MissionSchedule(at_unix_s=NOW.timestamp() + ahead_s)
    if why is None:
        check_schedule(schedule, NOW.timestamp())
        return
    with pytest.raises(MissionInvalid, match=why):
        check_schedule(schedule, NOW.timestamp())
