"""The ledger of alarms is kept by pure functions."""

from dataclasses import replace

from vla_deploy.dashboard.alarms.alarm import (
    BACK_SOON_S,
    MOST_ALARMS,
    AlarmFinding,
    AlarmSeverity,
    Ledger,
    acknowledge_alarm,
    end_all,
    update_ledger,
)

HOT = AlarmFinding(
    process="control",
    field="joint_temperature_limit",
    subject="left_elbow",
    text="hot",
    severity=AlarmSeverity.ERROR,
    advice="let it cool",
    measured=71.0,
    limit=70.0,
    unit="°C",
)


def holding(*findings):
    return {one.key: one for one in findings}


def begun(at_s=100.0):
    return update_ledger(Ledger(), holding(HOT), at_s)


def test_an_alarm_tells_what_its_condition_tells_and_since_when():
    (alarm,) = begun().alarms
    assert (alarm.id, alarm.finding.process, alarm.finding.subject) == (
        "1",
        "control",
        "left_elbow",
    )
    assert (alarm.finding.measured, alarm.finding.limit, alarm.finding.unit, alarm.since_s) == (
        71.0,
        70.0,
        "°C",
        100.0,
    )
    assert alarm.is_open
    assert alarm.acknowledged_by is None


def test_it_goes_on_with_new_numbers():
    later = update_ledger(begun(), holding(replace(HOT, measured=75.0)), 110.0)
    (alarm,) = later.alarms
    assert (alarm.finding.measured, alarm.since_s, alarm.ended_s) == (75.0, 100.0, None)


def test_seeing_it_does_not_end_it_and_the_first_who_has_is_kept():
    seen = acknowledge_alarm(acknowledge_alarm(begun(), "1", "anna", 105.0), "1", "bert", 106.0)
    (alarm,) = seen.alarms
    assert (alarm.acknowledged_by, alarm.acknowledged_s, alarm.is_open) == ("anna", 105.0, True)


def test_seeing_one_that_is_not_there_changes_nothing():
    assert acknowledge_alarm(begun(), "7", "anna", 105.0) == begun()


def test_it_ends_with_its_condition_and_stays_to_be_read():
    (alarm,) = update_ledger(begun(), {}, 120.0).alarms
    assert (alarm.ended_s, alarm.finding.text) == (120.0, "hot")


def test_one_that_comes_back_soon_is_the_same_and_stays_seen():
    gone = update_ledger(acknowledge_alarm(begun(), "1", "anna", 105.0), {}, 120.0)
    (alarm,) = update_ledger(gone, holding(HOT), 120.0 + BACK_SOON_S - 1).alarms
    assert (alarm.id, alarm.count, alarm.is_open) == ("1", 2, True)
    assert alarm.acknowledged_by == "anna"


def test_one_that_comes_back_late_is_a_new_one_that_nobody_has_seen():
    gone = update_ledger(acknowledge_alarm(begun(), "1", "anna", 105.0), {}, 120.0)
    before, again = update_ledger(gone, holding(HOT), 120.0 + BACK_SOON_S).alarms
    assert (before.id, again.id) == ("1", "2")
    assert again.acknowledged_by is None
    assert not before.is_open


def test_the_end_of_a_run_ends_what_was_open():
    assert [alarm.ended_s for alarm in end_all(begun(), 130.0).alarms] == [130.0]


def test_it_forgets_the_oldest_that_have_ended_before_any_that_lasts():
    ledger = begun()
    for number in range(3 * MOST_ALARMS):
        other = replace(HOT, subject=f"joint {number}")
        ledger = update_ledger(ledger, holding(HOT, other), 200.0 + number)
        ledger = update_ledger(ledger, holding(HOT), 200.5 + number)
    assert len(ledger.alarms) == MOST_ALARMS
    assert ledger.alarms[0].id == "1"
    assert ledger.alarms[-1].finding.subject == f"joint {3 * MOST_ALARMS - 1}"


def test_however_many_last_it_stays_bounded():
    many = holding(*(replace(HOT, subject=f"joint {number}") for number in range(500)))
    assert len(update_ledger(Ledger(), many, 1.0).alarms) == MOST_ALARMS
