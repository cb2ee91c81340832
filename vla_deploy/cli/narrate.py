"""Tell a command's events to a person, one line each."""

from collections.abc import Mapping
from typing import Any

from vla_deploy.client.action_words import action_words

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
    actions = event["plan"]["actions"]
    steps = "; ".join(action_words(one["skill"], one["parameters"]) for one in actions)
    rung = event.get("rung", "")
    return f"plan: {steps}" + (f"  (by {rung})" if rung not in ("", "patterns", "given") else "")


def _action_line(event: Mapping[str, Any]) -> str:
    words = action_words(event["skill"], event["parameters"])
    line = f"{SIGNS.get(event['status'], event['status'])} {words}"
    if event["status"] != "active":
        line += f"  ({event['execution_time_s']:.1f} s)"
    told = event["error"] or event.get("note")
    return f"{line}  {told}" if told else line
