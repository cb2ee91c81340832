"""Find what the parts of the robot report about themselves, and exceeded budgets."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Final

from drivers.twin_page import TwinPace
from vla_deploy.client.battery import battery_words
from vla_deploy.client.place_state import DOUBT_TEXT, Doubt
from vla_deploy.dashboard.alarms.alarm import AlarmFinding, AlarmSeverity
from vla_deploy.dashboard.alarms.robot_status import Document, RobotStatus

_LOADING_S: Final = 30.0
"""Models may load for this long after a start without an alarm."""
BUDGET_UNITS: Final[Mapping[str, str]] = {
    "memory_mb": "MB",
    "gpu_memory_mb": "MB",
    "cpu_ratio": "cores",
    "disk_free_mb": "MB",
    "power_w": "W",
    "temperature_c": "°C",
}
_COMPUTER: Final = "computer"
_REAL_TIME: Final = 0.8
_TWIN_RISE_S: Final = 10.0


def hearing(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find speech that cannot recognise words, spoken stops, or cannot speak."""
    speech = robot.document("speech_status")
    if speech is None:
        return
    finding = partial(
        AlarmFinding,
        process="speech",
        severity=AlarmSeverity.WARNING,
        age_s=robot.age_s("speech_status"),
        rise_s=_LOADING_S,
    )
    if speech["state"] == "deaf":
        text = f"the robot understands no words: {speech['why']}"
        yield finding(field="state", text=text, advice="type commands; vla-deploy doctor")
    stop_words = speech["stop_words"]
    if stop_words["state"] != "live" and stop_words["sensitivity"] != "off":  # the user's choice
        text = f"nobody can stop the robot by voice: {stop_words['why']}"
        advice = "keep to the other stops; vla-deploy doctor"
        yield finding(field="stop_words", text=text, advice=advice)
    if speech["voice"]["state"] != "ready" and speech["voice"]["why"]:
        text = f"the robot cannot speak: {speech['voice']['why']}"
        yield finding(field="voice", text=text, advice="vla-deploy doctor")


def seeing(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find sensors without data, faulty images, and a detector that is not available."""
    scene = robot.document("scene")
    if scene is None:
        return
    finding = partial(AlarmFinding, process="perception", age_s=robot.age_s("scene"))
    for sensor, why in scene["away"].items():
        yield finding(
            field="away",
            subject=sensor,
            text=f"the {sensor} gives nothing: {why}",
            severity=AlarmSeverity.ERROR,
            advice="check its cable and power; it is taken up again by itself",
        )
    for fault in scene["image"]["faults"]:
        yield finding(
            field="image",
            subject=fault,
            text=f"camera image: {fault}",
            severity=AlarmSeverity.WARNING,
            advice="clean and light it",
        )
    sight = scene["sight"]
    if sight["mode"] == "form" and sight["why"]:
        yield finding(
            field="sight",
            text=f"things are named by their form alone: {sight['why']}",
            severity=AlarmSeverity.INFO,
            advice="vla-deploy models list",
        )


def planning(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find planner back ends that are not available, and a memory that cannot be written."""
    planner = robot.document("planner_status")
    if planner is None:
        return
    finding = partial(
        AlarmFinding,
        process="planner",
        severity=AlarmSeverity.INFO,
        age_s=robot.age_s("planner_status"),
        rise_s=_LOADING_S,
    )
    for rung, why in planner["away"].items():
        text = f"commands are planned without {rung}: {why}"
        advice = "vla-deploy servers check; vla-deploy doctor"
        yield finding(field=f"rung {rung}", text=text, advice=advice)
    trouble = (planner.get("memory") or {}).get("trouble")
    if trouble:
        text = f"nothing is remembered: {trouble}"
        yield finding(field="memory", text=text, advice="vla-deploy doctor")


def place(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find an uncertain or lost position on the map."""
    pose = robot.document("pose")
    if pose is None or pose["state"] == "tracking":
        return
    is_lost = pose["state"] == "lost"
    where = "has lost its place on the map" if is_lost else "is not sure of its place on the map"
    yield AlarmFinding(
        process="perception",
        field="pose",
        text=f"the robot {where}: {DOUBT_TEXT[Doubt[pose['doubt'].upper()]]}",
        severity=AlarmSeverity.ERROR if is_lost else AlarmSeverity.WARNING,
        advice="drive it slowly where walls are near; compare map and room: vla-deploy map",
        measured=pose["match_ratio"],
        unit="of the lidar's points on the map",
        age_s=robot.age_s("pose"),
    )


def battery(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find a battery that is low, or whose charge nobody can tell."""
    told = robot.document("battery")
    if told is None:
        return
    finding = partial(
        AlarmFinding, process="supervisor", field="battery", age_s=robot.age_s("battery")
    )
    charge, is_critical = told["charge_ratio"], told["critical"]
    if told["low"]:
        severity = AlarmSeverity.ERROR if is_critical else AlarmSeverity.WARNING
        yield finding(
            text=f"the battery is {'nearly empty' if is_critical else 'low'}: "
            f"{battery_words(told)}",
            severity=AlarmSeverity.INFO if told["is_charging"] else severity,
            advice="let it charge: vla-deploy say go and charge",
            measured=charge,
            unit="of its capacity",
            rise_s=0.0,
        )
    elif charge is None:
        yield finding(
            text=f"the battery's {battery_words(told)}",
            severity=AlarmSeverity.WARNING,
            advice="look at the gauge and at [battery] of the robot file",
        )


def stop_door(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find a stop door that cannot be reached."""
    door = robot.document("stop_door_status")
    if door is None or not door["why"]:
        return
    yield AlarmFinding(
        process="stop_door",
        field="open",
        text=f"the stop door is {'not as set' if door['open'] else 'closed'}: {door['why']}",
        severity=AlarmSeverity.WARNING if door["open"] else AlarmSeverity.ERROR,
        advice="mend dashboard.toml or free the port; the dashboard's own stop goes on",
        age_s=robot.age_s("stop_door_status"),
    )


def exceeded_budgets(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find budgets that are exceeded, by their own hysteresis, or that cannot be measured."""
    budget = robot.document("budget")
    for row in budget["rows"] if budget is not None else ():
        if row["over"]:
            yield _over(row)
        elif row["state"] == "missing" and row["reason"]:
            yield _missing(row)


def steps_taken(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find the measures that the budget ladder has taken."""
    budget = robot.document("budget")
    for step in budget["ladder"]["taken"] if budget is not None else ():
        action = step["action"].replace("_", " ")
        yield AlarmFinding(
            process=step["process"] or _COMPUTER,
            field=f"ladder.{step['action']}",
            text=f"the budgets' ladder has taken the step {action}: {step['why']}",
            severity=AlarmSeverity.WARNING if step["action"] == "suspend" else AlarmSeverity.INFO,
            advice="it is undone by itself once there is room again; vla-deploy budget",
            measured=step["ratio"],
            unit="of its rate" if step["ratio"] is not None else "",
            age_s=step["since_s"],
        )


def slow_twin(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find a twin that is slower than real time: harmless where its time waits."""
    status = robot.document("twin_status")
    factor = None if status is None else status["real_time_factor"]
    if status is not None and factor is not None and factor < _REAL_TIME:
        waits = status["pace"] != TwinPace.WALL
        yield AlarmFinding(
            process="twin",
            field="real_time_factor",
            text=f"the twin is at {factor:.1f} of real time: all takes longer, nothing else changes"
            if waits
            else "the twin falls behind the wall clock: timings mean nothing",
            severity=AlarmSeverity.INFO if waits else AlarmSeverity.WARNING,
            advice="give the computer less to do",
            measured=round(factor, 3),
            limit=_REAL_TIME,
            age_s=robot.age_s("twin_status"),
            rise_s=_TWIN_RISE_S,
        )


def _over(row: Document) -> AlarmFinding:
    whose = row["process"] or _COMPUTER
    than = "less than" if row["at_least"] else "more than"
    return AlarmFinding(
        process=whose,
        field=row["metric"],
        text=f"{whose} has {than} its budget of {row['metric']}",
        severity=AlarmSeverity.WARNING,
        advice="see what it does: vla-deploy budget; vla-deploy logs",
        measured=row["measured"],
        limit=row["limit"],
        unit=BUDGET_UNITS.get(row["metric"], ""),
        rise_s=0.0,
    )


def _missing(row: Document) -> AlarmFinding:
    whose = row["process"] or _COMPUTER
    return AlarmFinding(
        process=whose,
        field=row["metric"],
        text=f"nobody can measure {row['metric']} of {whose}: {row['reason']}",
        severity=AlarmSeverity.INFO,
        advice="vla-deploy doctor",
        limit=row["limit"],
        unit=BUDGET_UNITS.get(row["metric"], ""),
    )
