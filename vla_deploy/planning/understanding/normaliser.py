"""Bring the values of a plan into the catalogue's form: units, hands, poses.

Only what has one meaning is changed. What has none stays as it is, and the validator names it.
"""

import re
from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.planning.catalogue import ARMS, SKILLS, Type
from vla_deploy.planning.plan import Action
from vla_deploy.planning.understanding.quantities import UNITS, quantity_of
from vla_deploy.world.relations import NEXT_TO

DIRECTIONS: Final[Mapping[str, str]] = {
    "forward": "ahead", "forwards": "ahead", "straight": "ahead", "straight ahead": "ahead",
    "front": "ahead", "upwards": "up", "downwards": "down", "floor": "down", "ceiling": "up",
}  # fmt: skip
RELATIONS: Final[Mapping[str, str]] = {
    "into": "in", "inside": "in", "inside of": "in", "within": "in", "onto": "on",
    "on top of": "on", "upon": "on", "over": "on", "at": "on", "to": "on",
    "next_to": NEXT_TO, "beside": NEXT_TO, "near": NEXT_TO, "close to": NEXT_TO, "by": NEXT_TO,
}  # fmt: skip
# With these, whichever hand is best takes.
_ANY_ARM: Final = frozenset({"", "any", "either", "auto", "default", "none", "null"})


def normalised(action: Action, poses: frozenset[str] = frozenset()) -> Action:
    """Return an action with its values in the catalogue's form; what is None is left out."""
    spec = SKILLS.get(action.skill)
    if spec is None:
        return action
    parameters: dict[str, Any] = {}
    for name, value in action.parameters.items():
        if value is None or (name == "arm" and str(value).strip().lower() in _ANY_ARM):
            continue
        parameter = spec.parameters.get(name)
        if parameter is not None and parameter.type is Type.NUMBER:
            value = _number(name, value)
        elif isinstance(value, str):
            value = _text(name, value, poses)
        parameters[name] = value
    return action.model_copy(update={"parameters": parameters})


def _number(name: str, value: Any) -> Any:
    """Return "50 cm" in the unit that the parameter's name ends in."""
    dimension = next((one for one in ("m_s", "rad", "m", "s") if name.endswith(f"_{one}")), "")
    if not isinstance(value, str) or dimension not in UNITS:
        return value
    quantity = quantity_of(value[:40], dimension)
    return value if quantity is None else quantity


def _text(name: str, value: str, poses: frozenset[str]) -> str:
    """Return the word of the catalogue for "left hand", "Look ahead", "forward", "into"."""
    said = value.strip().lower()
    match name:
        case "arm":
            side = re.sub(r"[ _-]?(?:hand|arm|gripper)$", "", said)
            return side if side in ARMS else value
        case "pose":
            pose = re.sub(r"[ -]+", "_", said)
            return pose if pose in poses else value
        case "direction":
            return DIRECTIONS.get(said, said)
        case "relation":
            return RELATIONS.get(said, said)
        case _:
            return value
