"""Find processes that are lost, restarted or silent, and topics with invalid values."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from vla_deploy.dashboard.alarms.alarm import AlarmFinding, AlarmSeverity
from vla_deploy.dashboard.alarms.robot_status import Document, RobotStatus
from vla_deploy.ipc import BY_NAME, TOPICS, Topic, TopicKind
from vla_deploy.supervisor.processes.lifecycle import ProcessState
from vla_deploy.supervisor.table import TABLE, GivingUp

GIVEN_UP: Final[Mapping[GivingUp, AlarmSeverity]] = {
    GivingUp.END_RUN: AlarmSeverity.CRITICAL,
    GivingUp.NO_COMMANDS: AlarmSeverity.ERROR,
    GivingUp.CARRY_ON: AlarmSeverity.WARNING,
}
_AGAIN: Final = (ProcessState.BACKOFF.value, ProcessState.ABORTING.value)
_WHAT_IT_MEANS: Final = {spec.name: spec.giving_up for spec in TABLE}
BY_OWNER: Final[Mapping[str, AlarmSeverity]] = {"control": AlarmSeverity.CRITICAL}
"""The severity of a silent topic by its owner; a warning for all others."""
ON_DEMAND: Final = frozenset({"base_command"})
"""Published only while the base is driven; safety judges its age then."""
OF_SENSOR: Final[Mapping[str, str]] = {
    "scan": "lidar",
    "imu": "imu",
    "near_obstacles": "camera",
}
"""Topics that depend on one sensor; `away` of the scene may give the reason."""
_SUPERVISOR: Final = "supervisor"
_LEAST_RATIO: Final = 0.01
_RISE_S: Final = 1.0
_CHECK_CABLE: Final = "check its cable and power; it is taken up again by itself"
_RESTARTED: Final = "the supervisor starts it again before long; see why"
_CELLS: Final = tuple(
    topic
    for topic in TOPICS
    if topic.kind is TopicKind.CELL and topic.deadline_s and topic.name not in ON_DEMAND
)


def silent_supervisor(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find a silent supervisor, for which control stops the robot, too."""
    age_s, limit_s = robot.age_s("process_table"), BY_NAME["process_table"].deadline_s
    if age_s is not None and age_s > limit_s:
        yield AlarmFinding(
            process="supervisor",
            field="process_table",
            text="the supervisor is silent: nobody restarts what fails",
            severity=AlarmSeverity.CRITICAL,
            advice="vla-deploy status; where the run has ended, start it anew",
            measured=age_s,
            limit=limit_s,
            unit="s",
            age_s=age_s,
        )


def lost_processes(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find processes that were given up, and those that are being restarted."""
    for row in _rows(robot):
        if row["state"] == ProcessState.GIVEN_UP.value:
            yield _given_up(row)
        elif row["state"] in _AGAIN or (
            row["state"] == ProcessState.STARTING.value and row["restarts"]
        ):
            yield _restarting(row)


def odd_topics(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find topics that the supervisor reports: rates too low, and invalid values."""
    for row in _rows(robot):
        for topic in row["topics"] if row["state"] == ProcessState.READY.value else ():
            yield from _low_rate(row["name"], topic)
            yield from _invalid_values(row["name"], topic)


def _rows(robot: RobotStatus) -> tuple[Document, ...]:
    table = robot.document("process_table")
    return () if table is None else tuple(table["processes"])


def _given_up(row: Document) -> AlarmFinding:
    meaning = _WHAT_IT_MEANS.get(row["name"], GivingUp.CARRY_ON)
    return AlarmFinding(
        process=row["name"],
        field="state",
        text=f"{row['name']} was given up: {row['reason']}; {meaning.value}",
        severity=GIVEN_UP[meaning],
        advice="look into vla-deploy crashes list, mend it, then start the run anew",
        measured=float(row["restarts"]),
        unit="restarts",
        rise_s=0.0,
    )


def _restarting(row: Document) -> AlarmFinding:
    return AlarmFinding(
        process=row["name"],
        field="restarts",
        text=f"{row['name']} is started again: {row['reason'] or 'it ended'}",
        severity=AlarmSeverity.WARNING,
        advice=f"vla-deploy crashes list; vla-deploy logs {row['name']}",
        measured=float(row["restarts"]),
        unit="restarts",
        rise_s=0.0,
    )


def _low_rate(process: str, topic: Document) -> Iterator[AlarmFinding]:
    rate_hz, least_hz = topic["rate_hz"], topic["least_hz"]
    if rate_hz is not None and rate_hz < least_hz:
        yield AlarmFinding(
            process=process,
            field=f"{topic['topic']} rate",
            text=f"{process} writes {topic['topic']} too seldom",
            severity=AlarmSeverity.WARNING,
            advice="the computer is too busy, or the process hangs: vla-deploy budget",
            measured=rate_hz,
            limit=least_hz,
            unit="Hz",
            age_s=topic["age_s"],
        )


def _invalid_values(process: str, topic: Document) -> Iterator[AlarmFinding]:
    for fault in topic["faults"]:
        yield AlarmFinding(
            process=process,
            field=topic["topic"],
            subject=fault.partition(":")[0],
            text=f"{process} writes what cannot be: {topic['topic']}.{fault}",
            severity=AlarmSeverity.ERROR,
            advice=f"vla-deploy logs {process}",
            age_s=topic["age_s"],
        )


def old_topics(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find cells beyond their deadline, which is longer for a process that was slowed down."""
    away = (robot.document("scene") or {}).get("away", {})
    for topic in _CELLS:
        age_s = robot.age_s(topic.name)
        if age_s is None or not _is_at_work(robot, topic) or OF_SENSOR.get(topic.name) in away:
            continue
        limit_s = topic.deadline_s / _rate_ratio(robot, topic.owner)
        if age_s > limit_s:
            yield _old(topic, age_s, limit_s, _silent_sensor(robot, topic))


def _is_at_work(robot: RobotStatus, topic: Topic[Any]) -> bool:
    """Return whether its age matters: a silent supervisor is another rule's finding."""
    if topic.owner == _SUPERVISOR:
        return topic.name != "process_table" and robot.document("process_table") is not None
    return robot.is_ready(topic.owner)


def _rate_ratio(robot: RobotStatus, process: str) -> float:
    directives = robot.document("resource_directives") or {}
    return max(float(directives.get("rate_ratio", {}).get(process, 1.0)), _LEAST_RATIO)


def _silent_sensor(robot: RobotStatus, topic: Topic[Any]) -> str:
    """Return the sensor that caused it, where its process still publishes other topics."""
    sensor = OF_SENSOR.get(topic.name, "")
    return sensor if sensor and robot.document("scene") is not None else ""


def _old(topic: Topic[Any], age_s: float, limit_s: float, sensor: str) -> AlarmFinding:
    culprit = f"the {sensor} has gone silent: no {topic.name}"
    return AlarmFinding(
        process=topic.owner,
        field=topic.name,
        subject=sensor,
        text=culprit if sensor else f"{topic.owner} has gone silent on {topic.name}",
        severity=BY_OWNER.get(topic.owner, AlarmSeverity.WARNING),
        advice=_CHECK_CABLE if sensor else f"{_RESTARTED}: vla-deploy logs {topic.owner}",
        measured=age_s,
        limit=limit_s,
        unit="s",
        age_s=age_s,
        rise_s=_RISE_S,
    )
