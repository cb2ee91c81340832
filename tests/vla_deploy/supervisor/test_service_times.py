"""The service manager's patience follows from the rows, so that neither is changed alone."""

from dataclasses import replace

import pytest

from vla_deploy.supervisor.health import HealthLimits
from vla_deploy.supervisor.notify import FEED_EVERY_NS
from vla_deploy.supervisor.processes.lifecycle import give_up_s
from vla_deploy.supervisor.service_times import (
    RESTART_S,
    START_BURST,
    longest_start_s,
    start_limit_s,
    watchdog_s,
)
from vla_deploy.supervisor.table import TABLE, GivingUp, ProcessSpec, Watched

CONTROL = next(row for row in TABLE if row.name == "control")


def test_the_watchdog_waits_until_a_hanging_control_is_up_again():
    assert watchdog_s() == 15  # 5 s silent, 1 s to tell where, 0.25 s, 8 s to start


def test_feeding_costs_the_watchdog_no_more_than_an_ageing_status_gives_it():
    assert HealthLimits().status_age_s >= FEED_EVERY_NS / 1e9


@pytest.mark.parametrize("longer_s", [1.0, 20.0])
def test_the_watchdog_follows_the_row(longer_s):
    watched = (Watched(topic="control_status", silence_limit_s=5.0 + longer_s),)
    assert watchdog_s([replace(CONTROL, watched=watched)]) == 15 + longer_s


def test_the_longest_start_waits_for_the_rows_before_and_for_none_beside():
    rows = (
        ProcessSpec(name="a", command=(), ready_timeout_s=7.0),
        ProcessSpec(name="b", command=(), ready_timeout_s=900.0, with_previous=True),
        ProcessSpec(name="c", command=(), ready_timeout_s=20.0),
        ProcessSpec(name="d", command=(), giving_up=GivingUp.CARRY_ON, ready_timeout_s=9999.0),
    )
    assert longest_start_s(rows[:1]) == give_up_s(rows[0])
    assert longest_start_s((rows[0], rows[2])) == 7.0 + give_up_s(rows[2])
    assert longest_start_s((rows[0], rows[3])) == give_up_s(rows[0])
    assert longest_start_s(rows[:2]) == give_up_s(rows[1])


def test_starts_that_fail_as_slowly_as_can_be_still_end_the_service():
    once_s = longest_start_s() + sum(row.stop_timeout_s for row in TABLE) + RESTART_S
    assert START_BURST * once_s <= start_limit_s() < START_BURST * once_s + 60
