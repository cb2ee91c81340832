"""Find what the parts say of themselves: ears, voice, sight, plans, place, stop door."""

from collections.abc import Iterator
from typing import Final

from vla_deploy.dashboard.alarms.finding import Finding, Severity
from vla_deploy.dashboard.alarms.told import Told
from vla_deploy.navigation.localising.place_judge import DOUBT_TEXT, Doubt

_LOADING_S: Final = 30.0
"""Models are being loaded for so long after a start; that is no alarm."""


def hearing(told: Told) -> Iterator[Finding]:
    """Find a robot that does not understand, cannot speak, or does not hear a spoken stop."""
    speech = told.document("speech_status")
    if speech is None:
        return
    age_s = told.age_s("speech_status")
    if speech["state"] == "deaf":
        text = f"the robot understands no words: {speech['why']}"
        yield _speech("state", text, "type commands; vla-deploy doctor", age_s)
    stop_words = speech["stop_words"]
    if stop_words["state"] != "live" and stop_words["sensitivity"] != "off":  # which is a choice
        text = f"nobody can stop the robot by voice: {stop_words['why']}"
        yield _speech("stop_words", text, "keep to the other stops; vla-deploy doctor", age_s)
    if speech["voice"]["state"] != "ready" and speech["voice"]["why"]:
        text = f"the robot cannot speak: {speech['voice']['why']}"
        yield _speech("voice", text, "vla-deploy doctor", age_s)


def seeing(told: Told) -> Iterator[Finding]:
    """Find sensors that give nothing, images that are not to be trusted, a network that is away."""
    scene = told.document("scene")
    if scene is None:
        return
    age_s = told.age_s("scene")
    for sensor, why in scene["away"].items():
        text = f"the {sensor} gives nothing: {why}"
        advice = "check its cable and power; it is taken up again by itself"
        yield _perception("away", sensor, text, Severity.ERROR, advice, age_s)
    for fault in scene["image"]["faults"]:
        text = f"camera image: {fault}"
        yield _perception("image", fault, text, Severity.WARNING, "clean and light it", age_s)
    sight = scene["sight"]
    if sight["mode"] == "form" and sight["why"]:
        text = f"things are named by their form alone: {sight['why']}"
        yield _perception("sight", "", text, Severity.INFO, "vla-deploy models list", age_s)


def planning(told: Told) -> Iterator[Finding]:
    """Find planners that are away, and a memory that cannot be written."""
    planner = told.document("planner_status")
    if planner is None:
        return
    age_s = told.age_s("planner_status")
    for rung, why in planner["away"].items():
        text = f"commands are planned without {rung}: {why}"
        yield _planner(f"rung {rung}", text, "vla-deploy servers check; vla-deploy doctor", age_s)
    trouble = (planner.get("memory") or {}).get("trouble")
    if trouble:
        yield _planner("memory", f"nothing is remembered: {trouble}", "vla-deploy doctor", age_s)


def place(told: Told) -> Iterator[Finding]:
    """Find a robot that is not sure of its place on the map, or has lost it."""
    pose = told.document("pose")
    if pose is None or pose["state"] == "tracking":
        return
    is_lost = pose["state"] == "lost"
    where = "has lost its place on the map" if is_lost else "is not sure of its place on the map"
    yield Finding(
        process="perception",
        field="pose",
        text=f"the robot {where}: {DOUBT_TEXT[Doubt[pose['doubt'].upper()]]}",
        severity=Severity.ERROR if is_lost else Severity.WARNING,
        advice="drive it slowly where walls are near; compare map and room: vla-deploy map",
        measured=pose["match_ratio"],
        unit="of the lidar's points on the map",
        age_s=told.age_s("pose"),
    )


def stop_door(told: Told) -> Iterator[Finding]:
    """Find a stop door that nobody can reach."""
    door = told.document("stop_door_status")
    if door is None or not door["why"]:
        return
    yield Finding(
        process="stop_door",
        field="open",
        text=f"the stop door is {'not as set' if door['open'] else 'closed'}: {door['why']}",
        severity=Severity.WARNING if door["open"] else Severity.ERROR,
        advice="mend dashboard.toml or free the port; the dashboard's own stop goes on",
        age_s=told.age_s("stop_door_status"),
    )


def _speech(field: str, text: str, advice: str, age_s: float | None) -> Finding:
    return Finding(
        process="speech",
        field=field,
        text=text,
        severity=Severity.WARNING,
        advice=advice,
        age_s=age_s,
        rise_s=_LOADING_S,
    )


def _perception(
    field: str, subject: str, text: str, severity: Severity, advice: str, age_s: float | None
) -> Finding:
    return Finding(
        process="perception",
        field=field,
        subject=subject,
        text=text,
        severity=severity,
        advice=advice,
        age_s=age_s,
    )


def _planner(field: str, text: str, advice: str, age_s: float | None) -> Finding:
    return Finding(
        process="planner",
        field=field,
        text=text,
        severity=Severity.INFO,
        advice=advice,
        age_s=age_s,
        rise_s=_LOADING_S,
    )
