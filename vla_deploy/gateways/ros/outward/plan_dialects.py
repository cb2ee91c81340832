"""Write the robot's plans in the dialects that other planning nodes read and write as JSON.

ranked   action_type, parameters, priority (an integer, 1 first), estimated_duration in s,
         feasibility_score
terse    action, params, description

Positions are x, y, z in m and angles in degrees, in the map's frame.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

Json = dict[str, Any]
Where = Callable[[str], Sequence[float] | None]
"""Return where a named place or a thing is, x, y, z in m of the map; None where nobody knows."""

_DECISION: Final = re.compile(r'"(?P<asked>[^"]*)" is (?P<chosen>.+?) \((?P<why>[^()]*)\)$')
_REFERRING: Final = ("object", "destination", "place")


def ranked_actions(plan: Mapping[str, Any], where: Where) -> list[Json]:
    """Return the actions of a plan; those with the same priority may run side by side."""
    depths = _depths(plan["actions"])
    ranked = []
    for action in plan["actions"]:
        name, parameters = ranked_name(action["skill"], action.get("parameters", {}), where)
        ranked.append(
            {
                "action_type": name,
                "parameters": parameters,
                "priority": depths[action["id"]],
                "estimated_duration": float(action.get("estimated_duration_s", 0.0)),
                "feasibility_score": float(action.get("feasibility_score", 1.0)),
            }
        )
    return ranked


def terse_plan(plan: Mapping[str, Any]) -> Json:
    """Return a plan as one that a vision-language planner wrote."""
    return {
        "goal": plan["goal"],
        "summary": plan.get("summary") or plan["goal"],
        "feasible": bool(plan.get("feasible", True)),
        "reasoning": plan.get("reasoning", ""),
        "actions": [terse_action(one) for one in plan["actions"]],
        "expected_duration": sum(one.get("estimated_duration_s", 0.0) for one in plan["actions"]),
        "safety_concerns": list(plan.get("safety_concerns", ())),
        "success_criteria": "; ".join(plan.get("success_criteria", ())),
    }


def terse_action(action: Mapping[str, Any]) -> Json:
    """Return one action of such a plan."""
    skill, given = action["skill"], action.get("parameters", {})
    name, renamed = _TERSE.get(skill, (skill, {}))
    params = {renamed.get(key, key): value for key, value in given.items()}
    words = [f"{one:.3g}" if isinstance(one, float) else str(one) for one in params.values()]
    description = action.get("description") or " ".join((name, *words))
    return {"action": name, "params": params, "description": description}


def resolved_actions(plan: Mapping[str, Any], where: Where) -> tuple[list[Json], list[str]]:
    """Return ranked actions with their `resolution_notes`, and the log of all resolutions.

    The planner's log is the plan's `reasoning`: what was asked, what was chosen, and why.
    """
    decisions = list(_decisions(str(plan.get("reasoning", ""))))
    actions, log = ranked_actions(plan, where), []
    for action, own in zip(actions, plan["actions"], strict=True):
        note = "; ".join(dict.fromkeys(_notes(own, decisions)))
        if note:
            action["resolution_notes"] = note
            log.append(f"Action {action['action_type']}: {note}")
    return actions, log


def ranked_name(skill: str, given: Mapping[str, Any], where: Where) -> tuple[str, Json]:
    """Return what the ranked dialect calls a skill, and its parameters there."""
    write = _RANKED.get(skill)
    return (skill, dict(given)) if write is None else write(given, where)


def _depths(actions: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """Return at which turn each action can come, 1 first: one more than what it waits for."""
    depths = {str(action["id"]): 1 for action in actions}
    for _ in actions:  # a validated plan has no cycles, but need not be in order
        for action in actions:
            earlier = (*action.get("depends_on", ()), *action.get("after", ()))
            before = [depths[name] for name in earlier if name in depths]
            depths[action["id"]] = 1 + max(before, default=0)
    return depths


def _navigate(given: Mapping[str, Any], where: Where) -> tuple[str, Json]:
    rest = {key: given[key] for key in ("speed_m_s",) if key in given}
    if "x_m" in given:
        position = [float(given["x_m"]), float(given["y_m"]), 0.0]
        yaw = {"yaw": float(given["yaw_rad"])} if "yaw_rad" in given else {}
        return "navigate_to", {"target_position": position, **yaw, **rest}
    key = "place" if "place" in given else "object"
    name = str(given.get(key, ""))
    named = {"destination" if key == "place" else "target_object": name}
    return "navigate_to", {**_at(name, where), **named, **rest}


def _place(given: Mapping[str, Any], where: Where) -> tuple[str, Json]:
    name = str(given.get("destination", ""))
    how = {"destination": name, "placement_type": given.get("relation", "on")}
    return "place_down", {**_at(name, where), **how, **_arm(given)}


def _move(given: Mapping[str, Any], where: Where) -> tuple[str, Json]:
    distance_m = float(given.get("distance_m", 0.0))
    return "move_forward" if distance_m >= 0 else "move_backward", {"distance": abs(distance_m)}


def _turn(given: Mapping[str, Any], where: Where) -> tuple[str, Json]:
    degrees = round(math.degrees(float(given.get("angle_rad", 0.0))), 3)
    return "turn_left" if degrees >= 0 else "turn_right", {"angle": abs(degrees)}


def _arm(given: Mapping[str, Any]) -> Json:
    return {"arm": given["arm"]} if "arm" in given else {}


def _at(name: str, where: Where) -> Json:
    position = where(name)
    return {} if position is None else {"target_position": [round(float(v), 4) for v in position]}


_RANKED: Final[Mapping[str, Callable[[Mapping[str, Any], Where], tuple[str, Json]]]] = {
    "navigate_to": _navigate,
    "pick_up": lambda given, _: (
        "pick_up",
        {"target_object": given.get("object", ""), **_arm(given)},
    ),
    "place": _place,
    "find_object": lambda given, _: ("find_object", {"object_type": given.get("object", "")}),
    "look_at": lambda given, _: (
        "look_at",
        {"direction": given["direction"]}
        if "direction" in given
        else {"target_object": given.get("object", "")},
    ),
    "speak": lambda given, _: ("speak", {"text_to_speak": given.get("text", "")}),
    "wait": lambda given, _: ("wait", {"duration": float(given.get("duration_s", 0.0))}),
    "move": _move,
    "turn": _turn,
}
_TERSE: Final[Mapping[str, tuple[str, Mapping[str, str]]]] = {
    "navigate_to": ("navigate", {"place": "destination", "object": "target"}),
    "pick_up": ("pick", {}),
    "place": ("place", {"destination": "location"}),
    "look_at": ("look_at", {"object": "target", "direction": "target"}),
    "speak": ("speak", {"text": "message"}),
    "wait": ("wait", {"duration_s": "duration"}),
}


def _decisions(reasoning: str) -> Iterator[tuple[str, str, str]]:
    for sentence in reasoning.split("; "):
        found = _DECISION.search(sentence)
        if found is not None:
            yield found["asked"], found["chosen"], found["why"]


def _notes(action: Mapping[str, Any], decisions: Sequence[tuple[str, str, str]]) -> Iterator[str]:
    given = action.get("parameters", {})
    named = {str(given[key]) for key in _REFERRING if key in given}
    for asked, chosen, why in decisions:
        if named & {asked, chosen, chosen.split(" (")[0]}:
            yield f"'{asked}' is {chosen}: {why}"
