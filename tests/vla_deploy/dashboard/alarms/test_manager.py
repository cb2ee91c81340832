"""Findings that last become alarms, which are stored, acknowledged, and published."""

import json

import pytest

from tests.vla_deploy.dashboard.conftest import payload_of
from vla_deploy.dashboard.alarms.alarm import AlarmFinding, AlarmSeverity
from vla_deploy.dashboard.alarms.manager import (
    RAISE_DELAYS,
    AlarmFeed,
    AlarmFile,
    AlarmManager,
    judge,
)
from vla_deploy.dashboard.alarms.robot_status import RobotStatus, TopicStatus
from vla_deploy.dashboard.live.message import LookTime

S = 1_000_000_000
HOT = AlarmFinding(
    process="control", field="heat", text="hot", severity=AlarmSeverity.WARNING, advice="cool it"
)
RISE_S, FALL_S = (
    RAISE_DELAYS[AlarmSeverity.WARNING].rise_s,
    RAISE_DELAYS[AlarmSeverity.WARNING].fall_s,
)


def play(*looks):
    """Judge (time in s, findings) after each other; return what is raised after each look."""
    conditions, raised = {}, []
    for at_s, findings in looks:
        conditions = judge(conditions, {one.key: one for one in findings}, round(at_s * S))
        raised.append([one.finding for one in conditions.values() if one.raised])
    return raised


def test_a_condition_becomes_an_alarm_once_it_has_lasted():
    assert play((0, [HOT]), (RISE_S - 0.1, [HOT]), (RISE_S, [HOT])) == [[], [], [HOT]]


def test_one_that_goes_before_its_time_is_none_and_begins_anew():
    assert play((0, [HOT]), (1, []), (RISE_S, [HOT]), (RISE_S + 1, [HOT])) == [[]] * 4


def test_an_alarm_ends_only_when_its_condition_has_been_gone_for_a_while():
    over_s = RISE_S + FALL_S
    looks = play((0, [HOT]), (RISE_S, [HOT]), (over_s - 0.1, []), (over_s, []))
    assert looks == [[], [HOT], [HOT], []]


def test_a_condition_that_comes_and_goes_is_one_alarm():
    looks = [(at_s, [HOT] if at_s % 2 else []) for at_s in range(int(RISE_S) + 1, 20)]
    raised = play((0, [HOT]), (RISE_S, [HOT]), *looks)
    assert raised[1:] == [[HOT]] * (len(looks) + 1)


def test_what_a_rule_says_of_its_patience_goes_before_the_table():
    at_once = AlarmFinding(**{name: getattr(HOT, name) for name in HOT.__slots__} | {"rise_s": 0.0})
    assert play((0, [at_once])) == [[at_once]]


def test_an_alarm_shows_the_newest_numbers():
    hotter = AlarmFinding(
        **{name: getattr(HOT, name) for name in HOT.__slots__} | {"measured": 80.0}
    )
    assert play((0, [HOT]), (RISE_S, [hotter]))[1][0].measured == 80.0


def test_the_graver_the_sooner():
    rises = [RAISE_DELAYS[severity].rise_s for severity in AlarmSeverity]
    assert rises == sorted(rises)
    assert set(RAISE_DELAYS) == set(AlarmSeverity)


ARMED = {"state": "armed", "cause": "", "estop_latched": False, "buses": {}, "detail": ""}
STOPPED = {
    **ARMED,
    "state": "stopped",
    "cause": "estop",
    "reaction": "group_stop",
    "subject": "page",
    "measured": None,
    "limit": None,
    "age_s": 0.0,
    "estop_latched": True,
}


def told(status):
    judged = {"tick": 10, "judged_tick": 10}
    return RobotStatus(
        topics={"control_status": TopicStatus(age_s=0.01, document={**status, **judged})}
    )


class Office:
    """A desk over a file, on a clock that the test moves."""

    def __init__(self, path, clock, run="run-1"):
        self.now = told(ARMED)
        self.clock = clock
        self.desk = AlarmManager(run, lambda: self.now, AlarmFile(path), clock, clock.wall_ns)

    def look_for(self, seconds):
        for _ in range(round(2 * seconds)):
            self.clock.pass_s(0.5)
            self.desk.step()

    def alarms(self):
        return self.desk.document()["alarms"]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "state" / "alarms.json"


@pytest.fixture
def office(path, hand_clock):
    return Office(path, hand_clock)


def test_a_stop_is_an_alarm_at_once_and_ends_when_it_is_reset(office):
    office.look_for(2)
    assert office.alarms() == []
    office.now = told(STOPPED)
    office.look_for(0.5)
    (alarm,) = office.alarms()
    assert (alarm["process"], alarm["field"], alarm["subject"]) == ("control", "estop", "page")
    assert alarm["text"] == "estop (page): control is stopped"
    assert alarm["since_s"] == office.clock.wall_ns() / 1e9
    office.now = told(ARMED)
    office.look_for(2.5)
    assert office.alarms()[0]["ended_s"] is None
    office.look_for(1)
    assert office.alarms()[0]["ended_s"] is not None


def test_alarms_and_who_has_seen_them_outlive_a_restart_of_the_dashboard(office, path, hand_clock):
    office.now = told(STOPPED)
    office.look_for(1)
    office.desk.acknowledge("1", "anna")
    before = office.alarms()
    again = Office(path, hand_clock)  # the first was killed: it had no time to write anything
    assert again.alarms() == before
    again.now = told(STOPPED)
    again.look_for(10)
    (alarm,) = again.alarms()
    assert (alarm["id"], alarm["count"], alarm["acknowledged_by"]) == ("1", 1, "anna")
    assert alarm["ended_s"] is None


def test_what_was_mended_while_the_dashboard_was_away_ends(office, path, hand_clock):
    office.now = told(STOPPED)
    office.look_for(1)
    again = Office(path, hand_clock)
    again.look_for(4)
    assert again.alarms()[0]["ended_s"] is not None


def test_a_new_run_of_the_robot_begins_without_the_alarms_of_the_last(office, path, hand_clock):
    office.now = told(STOPPED)
    office.look_for(1)
    (alarm,) = Office(path, hand_clock, run="run-2").alarms()
    assert alarm["ended_s"] == hand_clock.wall_ns() / 1e9


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"alarms": [{"id": "1"}], "run": "run-1", "next": 2}', "\x00"]
)
def test_a_spoilt_file_is_begun_anew(path, hand_clock, text):
    path.parent.mkdir()
    path.write_text(text)
    office = Office(path, hand_clock)
    assert office.alarms() == []
    office.now = told(STOPPED)
    office.look_for(1)
    assert json.loads(path.read_text())["alarms"][0]["field"] == "estop"


def test_a_disk_that_refuses_costs_no_alarm(tmp_path, hand_clock, caplog):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    office = Office(blocked / "alarms.json", hand_clock)
    office.now = told(STOPPED)
    office.look_for(3)
    office.desk.stop()
    assert len(office.alarms()) == 1
    assert [record.message for record in caplog.records if "outlive" in record.message]


def test_numbers_that_change_are_told_but_cost_no_write(office, path):
    office.now = told(STOPPED)
    office.look_for(1)
    written = path.stat().st_mtime_ns
    revision = office.desk.revision
    office.now = told({**STOPPED, "age_s": 1.0})
    office.look_for(1)
    assert office.desk.revision > revision
    assert path.stat().st_mtime_ns == written


def test_pages_are_told_on_change_alone(office, hand_clock):
    feed = AlarmFeed(office.desk)
    now = LookTime(run_ns=hand_clock.now_ns(), wall_ns=hand_clock.wall_ns())
    feed.begin()
    assert len(feed.look(now)) == 1
    assert feed.look(now) == ()
    office.now = told(STOPPED)
    office.look_for(1)
    (message,) = feed.look(now)
    assert json.loads(payload_of(message))["data"]["alarms"][0]["field"] == "estop"


def test_the_api_lists_alarms_and_notes_who_has_seen_one(dashboard):
    dashboard.robot.control_is(
        "stopped", **{name: STOPPED[name] for name in STOPPED if name != "state"}, tick=1,
        judged_tick=1,
    )  # fmt: skip
    dashboard.app.state.alarms.step()
    (alarm,) = dashboard.get("alarms")["alarms"]
    assert (alarm["severity"], alarm["acknowledged_by"]) == ("error", None)
    seen = dashboard.post(f"alarms/{alarm['id']}/acknowledge", 200)
    assert seen["acknowledged_by"] == "local"
    assert dashboard.get("alarms")["alarms"][0]["acknowledged_s"] == seen["acknowledged_s"]


@pytest.mark.parametrize(("alarm_id", "status"), [("99", 404), ("x", 422), ("1" * 30, 422)])
def test_an_alarm_that_is_not_there_cannot_be_seen(dashboard, alarm_id, status):
    assert "error" in dashboard.post(f"alarms/{alarm_id}/acknowledge", status)
