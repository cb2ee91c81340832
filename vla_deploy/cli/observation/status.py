"""`vla-deploy status`: what runs, what control says, where the robot is, what it does."""

import argparse
import math
from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.session import attach
from vla_deploy.client.battery import battery_words
from vla_deploy.client.place_state import DOUBT_TEXT, Doubt
from vla_deploy.supervisor.profiles.profile_change import ChangeOutcome
from vla_deploy.telemetry.robot_state import collect, motion_now

KEEPS_UP: Final = 0.95
"""Share of real time below which a process is named that holds the twin's time."""


def register(commands: Any) -> None:
    """Add the command."""
    add_top_command(
        commands,
        "status",
        "  vla-deploy status\n  vla-deploy status --json\n",
        run,
        json_help="print everything as JSON",
    )


def run(arguments: argparse.Namespace) -> int:
    """Print the status of the run on this machine."""
    session = attach(arguments.runtime_base)
    status = {**collect(session), "motion": motion_now(session)}
    return emit(arguments, status, lambda: as_text(status))


def as_text(status: dict[str, Any]) -> str:
    """Return the status as lines for a person."""
    return "\n".join(
        [
            *_replay(status),
            *_twin(status),
            *_processes(status),
            _profile(status),
            f"activity: {activity_words(status.get('activity'))}",
            *_agents(status),
            _control(status),
            *_last_stop(status),
            _pose(status),
            *_battery(status),
            *_planner(status),
            _task(status),
            _speech(status),
            _scene(status),
            *_vision(status),
        ]
    )


def _replay(status: dict[str, Any]) -> list[str]:
    shown = status.get("replay")
    if shown is None:
        return []
    place = f"{shown['position_s']:.0f} of {shown['duration_s']:.0f} s"
    return [f"REPLAY of {shown['file']}, {shown['state']} at {place}: no robot runs here"]


def _twin(status: dict[str, Any]) -> list[str]:
    twin = status["twin"]
    return [] if twin is None else [f"twin: {twin_words(twin)}"]


def twin_words(twin: Mapping[str, Any]) -> str:
    """Return how fast the twin's time goes, and which process holds it most."""
    factor, held_by = twin["real_time_factor"], twin["held_by"]
    held = f", held by {held_by}" if held_by and factor < KEEPS_UP else ""
    return f"at {factor:.1f} of real time{held}"


def _processes(status: dict[str, Any]) -> list[str]:
    table = status["process_table"]
    if table is None:
        return ["supervisor: silent"]
    lines = [f"{'process':<12} {'state':<10} {'pid':>7} {'restarts':>8} {'MB':>7} {'core':>6}"]
    for row in table["processes"]:
        memory = "-" if row["memory_mb"] is None else f"{row['memory_mb']:.0f}"
        share = "-" if row["cpu_ratio"] is None else f"{100 * row['cpu_ratio']:.0f} %"
        lines.append(
            f"{row['name']:<12} {row['state']:<10} {row['pid'] or '-':>7} {row['restarts']:>8} "
            f"{memory:>7} {share:>6}"
        )
        if row["reason"]:
            lines.append(f"  {row['name']}: {row['reason']}")
        lines.extend(f"  alarm: {alarm}" for alarm in row["alarms"])
    return [*lines, f"no commands: {table['refusal']}"] if table["refusal"] else lines


def _agents(status: dict[str, Any]) -> list[str]:
    """Return for how long AI agents may command the robot, nothing while they may not."""
    lease = status.get("agents")
    if not lease or not lease["may_act"]:
        return []
    return [f"agents may give commands for {lease['left_s']:.0f} s, by {lease['granted_by']}"]


def activity_words(document: Mapping[str, Any] | None) -> str:
    """Return what the robot does in one word, and what stops it."""
    if document is None:
        return "unknown, the supervisor is silent"
    why = document["stopped_by"]
    return f"{document['activity']} ({why})" if why else str(document["activity"])


def _profile(status: dict[str, Any]) -> str:
    profile = status["profile"]
    if profile is None:
        return "profile: unknown"
    change = f", on its way to {profile['target']}: {profile['phase']}" if profile["phase"] else ""
    last = profile["last"]
    failed = last.get("outcome") in (ChangeOutcome.REFUSED, ChangeOutcome.ROLLED_BACK)
    refused = f" ({last['profile']} {last['outcome']}: {last['reason']})" if failed else ""
    fault = profile.get("fault") and f"\n  alarm: {profile['fault']}"
    return f"profile: {profile['profile']}{change}{refused}{fault or ''}"


def _control(status: dict[str, Any]) -> str:
    control = status["control"]
    if control is None:
        return "control: silent"
    why = ": ".join(word for word in (control["cause"], control["detail"]) if word)
    latched = ", emergency stop latched" if control["estop_latched"] else ""
    return f"control: {control['state']}{latched}{_bounds(control)}" + (f" ({why})" if why else "")


def _last_stop(status: dict[str, Any]) -> list[str]:
    stop = (status["control"] or {}).get("last_stop")
    return [] if stop is None else [f"last stop: {last_stop_words(stop)}"]


def last_stop_words(stop: Mapping[str, Any]) -> str:
    """Return whether control has verified its last stop, and why not."""
    outcome = {
        "in_progress": "in progress",
        "verified": f"VERIFIED, at rest after {stop['standstill_s'] or 0.0:.2f} s",
        "failed": f"FAILED: {stop['reason']}",
    }[stop["state"]]
    by = f" ({stop['source']})" if stop["source"] else ""
    limit = f"category {stop['category']}, limit {stop['allowed_s']:.2f} s"
    return f"{outcome}; {stop['cause']}{by}, {stop['age_s']:.0f} s ago, {limit}"


def _bounds(control: dict[str, Any]) -> str:
    """Return the limits that the safety rules put on the base, and the age of the measurement."""
    words = []
    if control.get("speed_ratio", 1.0) < 1.0:
        words.append(f"base at most {100 * control['speed_ratio']:.0f} % of its speed")
    if control.get("blocked"):
        words.append(f"base not {', '.join(control['blocked'])}".replace("_", " "))
    if control.get("cause") and control.get("age_s"):
        words.append(f"measured {control['age_s']:.2f} s ago")
    return "".join(f", {word}" for word in words)


def _pose(status: dict[str, Any]) -> str:
    pose = status["pose"]
    if pose is None:
        return "pose: unknown"
    degrees = math.degrees(pose["yaw_rad"])
    where = f"pose: x {pose['x_m']:.2f} m, y {pose['y_m']:.2f} m, heading {degrees:.0f} degrees"
    if pose["state"] == "tracking":
        return where
    return f"{where}, {pose['state']}: {DOUBT_TEXT[Doubt[pose['doubt'].upper()]]}"


def _battery(status: dict[str, Any]) -> list[str]:
    battery = status.get("battery")
    return [] if battery is None else [f"battery: {battery_words(battery)}"]


def _planner(status: dict[str, Any]) -> list[str]:
    """Return which back ends plan, which are not available, and the open question."""
    planner = status["planner"]
    if planner is None:
        return ["plans: nothing, the planner is silent"]
    made = {name: rung.get("planned", 0) for name, rung in planner["by_rung"].items()}
    counts = [f"{name} {made.get(name, 0)}" for name in planner["rungs"]]
    lines = [f"plans by: {', '.join(counts)}; refused {planner['refused']}"]
    lines += [f"  without {name}: {why}" for name, why in planner["away"].items()]
    lines += [f"  told not to {one}" for one in planner.get("prohibitions", ())]
    return [*lines, f"asks: {planner['question']}"] if planner["question"] else lines


def _task(status: dict[str, Any]) -> str:
    executor = status["executor"]
    if executor is None:
        return "executor: silent"
    held = [f"{hand}: {what}" for hand, what in executor["holding"].items() if what]
    doing = executor["skill"] or executor["state"]
    return f"doing: {doing}; holding: {', '.join(held) or 'nothing'}"


def _scene(status: dict[str, Any]) -> str:
    scene = status["scene"]
    if scene is None:
        return "sees: nothing yet"
    seen = [
        f"{one['colour']} {one['class']} at {one['position_m'][0]:.2f}, {one['position_m'][1]:.2f}"
        for one in scene["objects"]
    ]
    return f"sees: {'; '.join(seen) or 'nothing'}"


def _vision(status: dict[str, Any]) -> list[str]:
    """Return how things are classified, and what is wrong with the camera's images."""
    scene = status["scene"]
    if scene is None or "sight" not in scene:
        return []
    sight, image = scene["sight"], scene["image"]
    by_form = sight["mode"] == "form"
    how = f"form alone ({sight['why']})" if by_form else _model(sight["model"])
    return [f"names by: {how}", *(f"  image: {fault}" for fault in image["faults"])]


def _model(model: dict[str, Any]) -> str:
    cost = f"{1000 * model['p50_s']:.0f} ms, {model['memory_mb']:.0f} MB"
    notices = f" ({'; '.join(model['notices'])})" if model["notices"] else ""
    return f"form and {model['model']} {model['variant']} on {model['provider']}, {cost}{notices}"


def _speech(status: dict[str, Any]) -> str:
    """Return whether the robot understands speech, and why not."""
    speech = status["speech"]
    if speech is None:
        return "hears: nothing, speech is silent"
    if speech["state"] == "deaf":
        return f"hears: no words ({speech['why']}); type commands"
    counts = ", ".join(
        f"{speech['heard'][name]} {name}" for name in ("accepted", "doubted", "rejected")
    )
    return f"hears: {speech['state']} by {speech['model']['name']}, {counts}"
