"""Find what the parts of the robot report about themselves, and exceeded budgets."""

from collections.abc import Iterator, Mapping
from typing import Final

from drivers.twin_page import TwinPace
from vla_deploy.dashboard.alarms.alarm import AlarmFinding, AlarmSeverity
from vla_deploy.dashboard.alarms.robot_status import Document, RobotStatus
from vla_deploy.navigation.place_judge import DOUBT_TEXT, Doubt

_LOADING_S: Final = 30.0
"""Models may load for this long after a start without an alarm."""


def hearing(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find speech that cannot recognise words, spoken stops, or cannot speak."""
    speech = robot.document("speech_status")
    if speech is None:
        return
    age_s = robot.age_s("speech_status")
    if speech["state"] == "deaf":
        text = f"the robot understands no words: {speech['why']}"
        yield _speech("state", text, "type commands; vla-deploy doctor", age_s)
    stop_words = speech["stop_words"]
    if stop_words["state"] != "live" and stop_words["sensitivity"] != "off":  # the user's choice
        text = f"nobody can stop the robot by voice: {stop_words['why']}"
        yield _speech("stop_words", text, "keep to the other stops; vla-deploy doctor", age_s)
    if speech["voice"]["state"] != "ready" and speech["voice"]["why"]:
        text = f"the robot cannot speak: {speech['voice']['why']}"
        yield _speech("voice", text, "vla-deploy doctor", age_s)


def seeing(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find sensors without data, faulty images, and a detector that is not available."""
    scene = robot.document("scene")
    if scene is None:
        return
    age_s = robot.age_s("scene")
    for sensor, why in scene["away"].items():
        text = f"the {sensor} gives nothing: {why}"
        advice = "check its cable and power; it is taken up again by itself"
        yield _perception("away", sensor, text, AlarmSeverity.ERROR, advice, age_s)
    for fault in scene["image"]["faults"]:
        text = f"camera image: {fault}"
        yield _perception("image", fault, text, AlarmSeverity.WARNING, "clean and light it", age_s)
    sight = scene["sight"]
    if sight["mode"] == "form" and sight["why"]:
        text = f"things are named by their form alone: {sight['why']}"
        yield _perception("sight", "", text, AlarmSeverity.INFO, "vla-deploy models list", age_s)


def planning(robot: RobotStatus) -> Iterator[AlarmFinding]:
    """Find planner back ends that are not available, and a memory that cannot be written."""
    planner = robot.document("planner_status")
    if planner is None:
        return
    age_s = robot.age_s("planner_status")
    for rung, why in planner["away"].items():
        text = f"commands are planned without {rung}: {why}"
        yield _planner(f"rung {rung}", text, "vla-deploy servers check; vla-deploy doctor", age_s)
    trouble = (planner.get("memory") or {}).get("trouble")
    if trouble:
        yield _planner("memory", f"nothing is remembered: {trouble}", "vla-deploy doctor", age_s)


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


def _speech(field: str, text: str, advice: str, age_s: float | None) -> AlarmFinding:
    return AlarmFinding(
        process="speech",
        field=field,
        text=text,
        severity=AlarmSeverity.WARNING,
        advice=advice,
        age_s=age_s,
        rise_s=_LOADING_S,
    )


def _perception(
    field: str, subject: str, text: str, severity: AlarmSeverity, advice: str, age_s: float | None
) -> AlarmFinding:
    return AlarmFinding(
        process="perception",
        field=field,
        subject=subject,
        text=text,
        severity=severity,
        advice=advice,
        age_s=age_s,
    )


def _planner(field: str, text: str, advice: str, age_s: float | None) -> AlarmFinding:
    return AlarmFinding(
        process="planner",
        field=field,
        text=text,
        severity=AlarmSeverity.INFO,
        advice=advice,
        age_s=age_s,
        rise_s=_LOADING_S,
    )


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
