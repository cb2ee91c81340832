"""Check a plan that somebody wrote: what each action became, what is not used, what is wrong."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from vla_deploy.cli.observation.plan import snapshot_of
from vla_deploy.cli.operation.say import read_json
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.planner import checked
from vla_deploy.plans.dialects import PlanNote, PlanReading, is_context, read_context, read_plan
from vla_deploy.plans.errors import PlanError, PlanInvalid
from vla_deploy.plans.knowledge import World
from vla_deploy.plans.plan import PUT_IN, Action, ExecutionOptions, Plan
from vla_deploy.plans.validator import refusal_document

# What a number is in, by the end of its name; the longest first.
_UNITS: Final[Mapping[str, str]] = {"_m_s": "m/s", "_rad": "rad", "_m": "m", "_s": "s"}


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanCheck:
    """Hold what came of checking a plan: as it was read, and as it would run, or the error."""

    reading: PlanReading | None = None
    plan: Plan | None = None
    notes: tuple[PlanNote, ...] = ()
    error: PlanError | None = None

    def document(self) -> dict[str, Any]:
        """Return it for JSON."""
        refused = refusal_document(self.error) if self.error is not None else {}
        return {
            "success": self.error is None,
            "plan": None if self.plan is None else self.plan.model_dump(mode="json"),
            "notes": [one.document() for one in self.notes],
            "validation_errors": refused.get("validation_errors", []),
            "dependency_errors": refused.get("dependency_errors", []),
        }

    def lines(self) -> list[str]:
        """Return each action as it would run, with what of it is not used, for a person."""
        if self.plan is None:
            return []
        lines = [f"  {note}" for note in self.notes if not note.action_id]
        if self.plan.options != ExecutionOptions():
            options = self.plan.options.model_dump(mode="json", exclude_defaults=True)
            told = ", ".join(f"{key} {value}" for key, value in options.items())
            lines.append(f"  options: {told}")
        width = max(len(one.id) for one in self.plan.actions)
        left = [note for note in self.notes if note.action_id]
        for action in self.plan.actions:
            put_in = " (put in)" if action.description == PUT_IN else ""
            told = ", ".join(quantity_words(*one) for one in action.parameters.items())
            lines.append(
                f"  {action.id:<{width}}  {' '.join((action.skill, told))}{put_in}".rstrip()
            )
            own = [note for note in left if note.action_id == action.id]
            lines += [f"  {'':<{width}}    {note.line}" for note in own]
            left = [note for note in left if note not in own]
        return lines + [f"  {note}" for note in left]


def _action_line(action: Action) -> str:
    told = ", ".join(quantity_words(*one) for one in action.parameters.items())
    words = (action.skill, told, "(put in)" if action.description == PUT_IN else "")
    return " ".join(word for word in words if word)


def check_plan_file(path: Path, scene: Path | None, world: World) -> PlanCheck:
    """Check a plan in a file, in a scene where one is given.

    Raises:
        UsageError: a file cannot be read, or is no JSON.
        SceneUnreadable: the scene is none.
    """
    document = read_json(path, "plan")
    around = None if scene is None else read_json(scene, "scene")
    notes: tuple[PlanNote, ...] = ()
    reading = None
    try:
        snapshot = None
        if is_context(around):
            context = read_context(around, world)
            world, snapshot, notes = context.world, context.scene, context.notes
        elif around is not None:
            snapshot = snapshot_of(around)
        reading = read_plan(document)
        notes = (*notes, *reading.notes)
        request = PlanRequest(command_id="", text="", world=world, scene=snapshot)
        return PlanCheck(reading=reading, plan=checked(reading.plan, request), notes=notes)
    except PlanError as error:
        named = PlanInvalid([f'action "{error.action_id}": {error}']) if error.action_id else error
        return PlanCheck(reading=reading, notes=notes, error=named)


def quantity_words(name: str, value: Any) -> str:
    """Return a parameter with its unit: "angle 1.57 rad (90°)", "object red cup"."""
    end = next((one for one in _UNITS if name.endswith(one)), "")
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not end or not is_number:
        return f"{name} {value}"
    words = f"{name.removesuffix(end)} {value:.4g} {_UNITS[end]}"
    return f"{words} ({math.degrees(value):.4g}°)" if end == "_rad" else words
