"""Collect what is wrong with an author's plan, and what of it is not used as it is written."""

from dataclasses import dataclass, field
from typing import Any, Final

from vla_deploy.plans.dialects.values import NotMeant, Read, ValueReading
from vla_deploy.runtime.one_line import one_line

_VALUE_CHARACTERS: Final = 60


@dataclass(frozen=True, slots=True)
class PlanNote:
    """Say what became of one key of an author's plan; `action_id` is "" for the plan's own keys."""

    action_id: str
    key: str
    value: str
    text: str

    def __str__(self) -> str:
        return f"{self.action_id}: {self.line}" if self.action_id else self.line

    @property
    def line(self) -> str:
        """Return what became of the key, without the action's name."""
        return printable(f"{self.key} {self.value}".rstrip() + f": {self.text}")

    def document(self) -> dict[str, str]:
        """Return it as JSON takes it."""
        return {
            "action_id": self.action_id,
            "key": self.key,
            "value": self.value,
            "note": self.text,
        }


@dataclass(slots=True)
class Findings:
    """Hold both while a plan is read; nothing of it runs where there is a fault."""

    faults: list[str] = field(default_factory=list)
    notes: list[PlanNote] = field(default_factory=list)

    def note(self, action_id: str, key: str, value: Any, text: str) -> None:
        """Say what became of a value."""
        self.notes.append(PlanNote(action_id, key, shown(value), text))

    def fault(self, action_id: str, text: str) -> None:
        """Say what is wrong with an action, or with the plan itself where the id is ""."""
        text = printable(text)
        self.faults.append(f'action "{action_id}": {text}' if action_id else text)

    def read(self, action_id: str, key: str, value: Any, read: Read) -> ValueReading | None:
        """Return what a value means, None where that is a fault."""
        try:
            taken = read(value)
        except NotMeant as error:
            self.fault(action_id, f"{key} must be {error}; got {shown(value)}")
            return None
        if taken.note:
            self.note(action_id, key, value, taken.note)
        return taken


def printable(said: str) -> str:
    """Return a text in one line, without what would move a terminal's cursor."""
    return "".join(one if one.isprintable() else "?" for one in one_line(said))


def shown(value: Any) -> str:
    """Return a value as it stands in JSON, cut where it is long."""
    if value is None:
        return ""
    if isinstance(value, str):
        said = f'"{value}"'
    elif isinstance(value, bool):
        said = str(value).lower()
    else:
        said = repr(value)
    said = printable(said)
    return said if len(said) <= _VALUE_CHARACTERS else f"{said[:_VALUE_CHARACTERS]}..."
