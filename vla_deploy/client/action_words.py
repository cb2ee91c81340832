"""Say a plan's action in a few words, as terminal and plan summaries do."""

from collections.abc import Iterable, Mapping
from typing import Any


def action_words(skill: str, parameters: Mapping[str, Any]) -> str:
    """Return an action in words: "pick up red cup", "place in box"."""
    values = dict(parameters)
    if "relation" in values and "destination" in values:
        values["destination"] = values.pop("destination")  # "in" goes before "box"
    told = (f"{value:g}" if isinstance(value, float) else str(value) for value in values.values())
    return " ".join([skill.replace("_", " "), *told])


def skill_words(skills: Iterable[tuple[str, Mapping[str, Any]]]) -> str:
    """Return skills with their parameters in words, one after the other."""
    return ", ".join(action_words(skill, parameters) for skill, parameters in skills)
