"""Judge words that real processes told on a twin: `twin_words.json` holds what differs by case.

In its cases the computer was too busy for the servo bus, somebody stopped the robot by the command
line, the planner was killed, and speech was frozen.
"""

import json
from copy import deepcopy
from pathlib import Path

import pytest

from vla_deploy.dashboard.alarms.alarm import AlarmSeverity
from vla_deploy.dashboard.alarms.control_rules import BY_REACTION, LATE_RATIO, UNITS
from vla_deploy.dashboard.alarms.process_rules import GIVEN_UP
from vla_deploy.dashboard.alarms.robot_status import RobotStatus, TopicStatus
from vla_deploy.dashboard.alarms.rules import find
from vla_deploy.ipc import BY_NAME
from vla_deploy.safety import Cause, Reaction
from vla_deploy.supervisor.table import GivingUp

WORDS = json.loads(Path(__file__).with_name("twin_words.json").read_text())


class Words:
    """The words of a case, which a test may change and let grow old."""

    def __init__(self, case="armed"):
        self.documents = deepcopy({**WORDS["armed"], **WORDS[case]})
        self.ages_s = dict.fromkeys(self.documents, 0.01)
        self.late_ratio = None

    def row(self, process):
        rows = self.documents["process_table"]["processes"]
        return next(row for row in rows if row["name"] == process)

    def findings(self):
        words = {
            topic: TopicStatus(age_s=age_s, document=self.documents.get(topic))
            for topic, age_s in self.ages_s.items()
        }
        return list(find(RobotStatus(topics=words, late_ratio=self.late_ratio)).values())

    def only(self):
        (finding,) = self.findings()
        return finding


@pytest.fixture
def words():
    return Words()


def test_an_armed_robot_in_order_has_no_alarm(words):
    assert words.findings() == []


def test_before_anybody_has_told_anything_there_is_none():
    assert find(RobotStatus()) == {}


# --- real cases ------------------------------------------------------------------------------


def test_a_lost_servo_bus_names_cause_bus_and_servos():
    found = {one.field: one for one in Words("lost_bus").findings()}
    cause = found["servo_bus_lost"]
    assert (cause.process, cause.severity) == ("control", AlarmSeverity.ERROR)
    assert cause.advice == "check the bus cable and the servo's power"
    lost = found["buses.servos.lost"]
    assert (lost.measured, lost.limit) == (16.0, 0.0)
    assert lost.text.startswith("bus servos has lost: left_shoulder_yaw, left_shoulder_pitch,")
    assert lost.text.endswith("and 12 more")
    assert found["buses.servos"].text == "bus servos is lost: too many answers missing or damaged"


def test_an_emergency_stop_names_who_pressed_and_how_it_ends():
    stop = Words("estop").only()
    assert (stop.process, stop.field, stop.subject) == ("control", "estop", "cli")
    assert stop.text == "estop (cli): control is stopped"
    assert stop.advice == "release the button, then reset, then arm"
    assert stop.rise_s == 0.0


def test_a_killed_planner_is_named_with_the_signal():
    killed = Words("planner_killed").only()
    assert (killed.process, killed.field, killed.measured) == ("planner", "restarts", 1.0)
    assert killed.text == "planner is started again: killed by signal 9"


def test_a_frozen_process_is_named_by_what_it_no_longer_writes():
    words = Words("speech_frozen")
    words.ages_s["speech_status"] = 3.7
    words.row("planner")["state"] = "ready"
    found = {one.field: one for one in words.findings()}
    assert set(found) == {"speech_status", "speech_status rate"}
    silent = found["speech_status"]
    assert (silent.process, silent.measured, silent.limit, silent.unit) == ("speech", 3.7, 2.0, "s")
    seldom = found["speech_status rate"]
    assert (seldom.measured, seldom.limit, seldom.unit) == (1.5, 2.5, "Hz")


# --- processes -------------------------------------------------------------------------------


def test_a_silent_supervisor_hides_what_its_old_table_says():
    words = Words("planner_killed")
    words.ages_s["process_table"] = 3.1
    silent = words.only()
    assert (silent.process, silent.severity) == ("supervisor", AlarmSeverity.CRITICAL)
    assert (silent.measured, silent.limit) == (3.1, 3.0)


@pytest.mark.parametrize(
    ("process", "severity"),
    [
        ("control", AlarmSeverity.CRITICAL),
        ("executor", AlarmSeverity.ERROR),
        ("stop_door", AlarmSeverity.WARNING),
        ("some_newer_part", AlarmSeverity.WARNING),
    ],
)
def test_who_was_given_up_is_as_grave_as_what_that_means(words, process, severity):
    row = {**words.row("executor"), "name": process, "state": "given up", "reason": "exit code 1"}
    words.documents["process_table"]["processes"].append(row)
    given_up = words.only()
    assert (given_up.process, given_up.severity) == (process, severity)
    assert given_up.text.startswith(f"{process} was given up: exit code 1; ")


def test_what_cannot_be_in_a_topic_is_told(words):
    words.row("control")["topics"][1]["faults"] = ["position: not finite, expected numbers"]
    nonsense = words.only()
    assert (nonsense.field, nonsense.subject) == ("joint_state", "position")
    assert "joint_state.position: not finite" in nonsense.text


def test_a_first_start_is_no_alarm(words):
    words.row("perception").update(state="starting", restarts=0)
    words.ages_s["scene"] = 20.0
    assert words.findings() == []


# --- topics ----------------------------------------------------------------------------------


def test_a_control_that_no_longer_tells_its_joints_is_critical(words):
    words.ages_s["joint_state"] = 0.06
    silent = words.only()
    assert (silent.process, silent.field, silent.limit) == ("control", "joint_state", 0.05)
    assert silent.severity is AlarmSeverity.CRITICAL


def test_whoever_is_told_to_work_slowly_has_more_time(words):
    words.ages_s["near_obstacles"] = 1.9
    assert words.only().limit == 1.0
    words.documents["resource_directives"]["rate_ratio"] = {"perception": 0.5}
    assert words.findings() == []


def test_a_base_that_nobody_drives_needs_no_commands(words):
    words.ages_s["base_command"] = 1000.0
    assert words.findings() == []


def test_a_silent_lidar_is_told_apart_from_a_silent_perception(words):
    words.ages_s["scan"] = 2.9
    assert words.only().text == "the lidar has gone silent: no scan"
    words.ages_s["scene"] = 2.9
    found = {one.field: one.text for one in words.findings()}
    assert found["scan"] == "perception has gone silent on scan"


def test_a_sensor_that_is_away_is_one_alarm_that_says_why(words):
    words.ages_s["scan"] = 2.9
    words.documents["scene"]["away"] = {"lidar": "/dev/lidar does not exist"}
    away = words.only()
    assert (away.field, away.subject, away.severity) == ("away", "lidar", AlarmSeverity.ERROR)
    assert away.text == "the lidar gives nothing: /dev/lidar does not exist"


# --- control ---------------------------------------------------------------------------------


def test_a_cause_carries_its_numbers_with_their_unit(words):
    words.documents["control_status"].update(
        state="stopped", cause="joint_temperature_limit", reaction="hold", subject="left_elbow",
        measured=71.0, limit=70.0, age_s=0.2,
    )  # fmt: skip
    hot = words.only()
    assert (hot.measured, hot.limit, hot.unit, hot.age_s) == (71.0, 70.0, "°C", 0.2)
    assert hot.text == "joint temperature limit (left_elbow): control is stopped"


def test_every_cause_with_numbers_has_a_unit_and_every_reaction_a_gravity():
    without = {Cause.NONE, Cause.ESTOP, Cause.BUDGET_EXHAUSTED}
    assert set(UNITS) == set(Cause) - without
    assert set(BY_REACTION) == set(Reaction)
    assert set(GIVEN_UP) == set(GivingUp)


def test_a_fault_without_a_cause_is_told_by_its_detail(words):
    words.documents["control_status"].update(state="fault", detail="the robot file has changed")
    assert words.only().text == "control cannot be armed: the robot file has changed"


def test_a_control_that_ticks_late_or_unjudged_is_told(words):
    words.late_ratio = LATE_RATIO
    assert words.findings() == []
    words.late_ratio = 0.25
    assert (words.only().measured, words.only().unit) == (0.25, "of all ticks")
    words.late_ratio = None
    words.documents["control_status"]["judged_tick"] -= 3
    assert (words.only().severity, words.only().measured) == (AlarmSeverity.CRITICAL, 3.0)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"can": {}}, "bus can is not open"),
        ({"can": {"lost_nodes": 1}}, "bus can has lost nodes"),
        ({"can": {"degraded_nodes": 1}}, "bus can has nodes that answer badly"),
        ({"can": {"bus_degraded": 1}}, "bus can carries damaged frames"),
        ({"servos": {"budget": {"bus": "degraded"}}}, "bus servos is degraded: answers go missing"),
    ],
)
def test_each_bus_tells_what_is_wrong_with_it(words, changes, text):
    words.documents["control_status"]["buses"].update(changes)
    assert words.only().text == text


def test_devices_may_be_without_power_while_the_emergency_stop_is_latched():
    words = Words("lost_bus")
    words.documents["control_status"]["estop_latched"] = True
    assert not [one.field for one in words.findings() if one.field.startswith("buses")]


# --- budgets and parts -----------------------------------------------------------------------


def test_an_exceeded_budget_names_whose_and_by_how_much(words):
    row = next(row for row in words.documents["budget"]["rows"] if row["process"] == "speech")
    row.update(over=True, state="over", measured=row["limit"] + 1)
    over = words.only()
    assert (over.process, over.field, over.limit) == ("speech", row["metric"], row["limit"])
    assert over.text == f"speech has more than its budget of {row['metric']}"


def test_what_nobody_can_measure_and_what_the_ladder_does_is_told(words):
    budget = words.documents["budget"]
    budget["rows"].append(
        {**budget["rows"][0], "process": None, "metric": "power_w", "measured": None,
         "state": "missing", "reason": "no sensor"}
    )  # fmt: skip
    budget["ladder"]["taken"] = [
        {"action": "slow", "process": "perception", "ratio": 0.5, "since_s": 3.0, "why": "cpu"}
    ]
    texts = {one.process: one.text for one in words.findings()}
    assert texts == {
        "computer": "nobody can measure power_w of computer: no sensor",
        "perception": "the budgets' ladder has taken the step slow: cpu",
    }


@pytest.mark.parametrize(
    ("topic", "change", "text"),
    [
        ("speech_status", {"state": "deaf", "why": "no microphone"},
         "the robot understands no words: no microphone"),
        ("speech_status", {"stop_words": {"state": "down", "why": "none", "sensitivity": "low"}},
         "nobody can stop the robot by voice: none"),
        ("speech_status", {"voice": {"state": "away", "why": "no speaker"}},
         "the robot cannot speak: no speaker"),
        ("scene", {"image": {"faults": ["dark: mean 3, limit 10"]}},
         "camera image: dark: mean 3, limit 10"),
        ("scene", {"sight": {"mode": "form", "why": "no model"}},
         "things are named by their form alone: no model"),
        ("planner_status", {"away": {"server big": "refused"}},
         "commands are planned without server big: refused"),
        ("planner_status", {"memory": {"trouble": "disk full"}},
         "nothing is remembered: disk full"),
        ("stop_door_status", {"open": False, "why": "port 8089 is taken"},
         "the stop door is closed: port 8089 is taken"),
        ("twin_status", {"pace": "wall", "real_time_factor": 0.5},
         "the twin falls behind the wall clock: timings mean nothing"),
        ("twin_status", {"pace": "real", "real_time_factor": 0.5},
         "the twin is at 0.5 of real time: all takes longer, nothing else changes"),
    ],
)  # fmt: skip
def test_each_part_tells_what_it_lacks(words, topic, change, text):
    words.documents[topic].update(change)
    assert words.only().text == text


def test_stop_words_that_a_person_has_switched_off_are_no_alarm(words):
    stop_words = {"state": "off", "why": "switched off by the profile", "sensitivity": "off"}
    words.documents["speech_status"]["stop_words"] = stop_words
    assert words.findings() == []


def test_a_lost_place_on_the_map_says_why(words):
    words.ages_s["pose"] = 0.02
    words.documents["pose"] = {"state": "lost", "doubt": "poor_match", "match_ratio": 0.2}
    lost = words.only()
    assert (lost.severity, lost.measured) == (AlarmSeverity.ERROR, 0.2)
    assert lost.text.endswith("lost its place on the map: what the lidar sees does not fit the map")


def test_what_a_silent_part_said_last_is_not_believed(words):
    words.documents["speech_status"].update(state="deaf", why="no microphone")
    words.ages_s["speech_status"] = BY_NAME["speech_status"].deadline_s + 0.1
    assert [one.field for one in words.findings()] == ["speech_status"]


def test_a_form_that_no_rule_knows_is_told_and_costs_no_other_alarm():
    words = Words("estop")
    words.documents["speech_status"] = {"state": "listening"}
    found = {one.process: one for one in words.findings()}
    assert set(found) == {"control", "dashboard"}
    assert found["dashboard"].text.startswith("nobody judges hearing: ")
    assert "KeyError('stop_words')" in found["dashboard"].text


def test_every_finding_says_what_to_try():
    for case in WORDS:
        for finding in Words(case).findings():
            assert finding.advice
            assert finding.text


BATTERY = {
    "charge_ratio": 0.2, "voltage_v": 25.0, "current_a": -1.0, "is_charging": False,
    "is_estimate": False, "low": True, "critical": False, "missing": {},
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "severity", "text"),
    [
        ({}, AlarmSeverity.WARNING, "the battery is low: 20 %, 25.0 V, -1.0 A, low"),
        ({"critical": True}, AlarmSeverity.ERROR, "the battery is nearly empty: 20 %"),
        ({"is_charging": True}, AlarmSeverity.INFO, "the battery is low: 20 %"),
        ({"low": False, "charge_ratio": None, "missing": {"charge_ratio": "no gauge"}},
         AlarmSeverity.WARNING, "the battery's charge unknown (no gauge)"),
    ],
)  # fmt: skip
def test_a_battery_that_is_low_or_that_nobody_can_judge_is_told(words, changes, severity, text):
    words.documents["battery"] = {**BATTERY, **changes}
    words.ages_s["battery"] = 1.0
    found = words.only()
    assert found.severity is severity
    assert text in found.text
    words.documents["battery"] = {**BATTERY, "low": False}
    assert words.findings() == []
