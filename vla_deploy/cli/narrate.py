"""Tell a command's events to a person, one line each."""

from collections.abc import Mapping
from typing import Any

SIGNS: Mapping[str, str] = {
    "active": "…",
    "succeeded": "✓",
    "aborted": "✗",
    "cancelled": "-",
    "rejected": "✗",
}


def line_of(event: Mapping[str, Any]) -> str | None:
    """Return one line for an event, or None for one that says nothing new."""
    match event["event"]:
        case "queued":
            return f"waits for {event['place']} before it"
        case "planning":
            return f"asking {', '.join(event['rungs'])} ..."
        case "asked":
            return f"robot asks: {event['question']}"
        case "plan":
            return _plan_line(event)
        case "action":
            return _action_line(event)
        case "setback":
            return "looking for another way ..."
        case "said":
            return f"robot says: {event['text']}"
        case "rejected":
            return f"refused: {event['reason']}"
        case "finished":
            return "done" if event["success"] else f"failed: {event['error']}"
    return None


def _plan_line(event: Mapping[str, Any]) -> str:
    steps = "; ".join(action_words(action) for action in event["plan"]["actions"])
    rung = event.get("rung", "")
    return f"plan: {steps}" + (f"  (by {rung})" if rung not in ("", "rules", "given") else "")


def action_words(action: Mapping[str, Any]) -> str:
    """Return an action in words: "pick up red cup"."""
    values = [
        f"{value:g}" if isinstance(value, float) else str(value)
        for value in action["parameters"].values()
    ]
    return " ".join([action["skill"].replace("_", " "), *values])


def _action_line(event: Mapping[str, Any]) -> str:
    line = f"{SIGNS.get(event['status'], event['status'])} {action_words(event)}"
    if event["status"] != "active":
        line += f"  ({event['execution_time_s']:.1f} s)"
    told = event["error"] or event.get("note")
    return f"{line}  {told}" if told else line
