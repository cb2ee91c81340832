"""Hold what the doctor found, and write it for a person within 100 columns or as a document."""

import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any, Final


class FindingLevel(StrEnum):
    """Grade a finding; `missing` means that it could not be found out, or is not installed."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"
    MISSING = "missing"


@dataclass(frozen=True, slots=True, kw_only=True)
class DoctorFinding:
    """Hold one line; `remedy` is a command to type, empty where nothing needs one."""

    name: str
    level: FindingLevel
    measured: str
    remedy: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """Hold the findings of one topic."""

    topic: str
    findings: tuple[DoctorFinding, ...]


def ok(name: str, measured: str) -> DoctorFinding:
    """Return a finding that needs nothing."""
    return DoctorFinding(name=name, level=FindingLevel.OK, measured=measured)


def warn(name: str, measured: str, remedy: str) -> DoctorFinding:
    """Return a finding under which the stack runs, but not as it should."""
    return DoctorFinding(name=name, level=FindingLevel.WARN, measured=measured, remedy=remedy)


def fail(name: str, measured: str, remedy: str) -> DoctorFinding:
    """Return a finding that keeps the stack from running."""
    return DoctorFinding(name=name, level=FindingLevel.FAIL, measured=measured, remedy=remedy)


def trouble(name: str, measured: str, remedy: str, *, fatal: bool) -> DoctorFinding:
    """Return a failure where it is `fatal` to what the profile promises, else a warning."""
    return fail(name, measured, remedy) if fatal else warn(name, measured, remedy)


def missing(name: str, why: str, remedy: str = "") -> DoctorFinding:
    """Return a finding that could not be made."""
    return DoctorFinding(name=name, level=FindingLevel.MISSING, measured=why, remedy=remedy)


COLUMNS: Final = 100
_NAME_COLUMNS: Final = 18
_INDENT: Final = 2 + len(FindingLevel.MISSING) + 2 + _NAME_COLUMNS + 1
_LEAST_INDENT: Final = 7
_ARROW: Final = "-> "
_COMMENT: Final = "   # "


def succeeded(sections: Sequence[Section]) -> bool:
    """Return whether nothing failed."""
    return all(
        one.level is not FindingLevel.FAIL for section in sections for one in section.findings
    )


def as_document(sections: Sequence[Section]) -> dict[str, Any]:
    """Return everything as a JSON document."""
    rows = [
        {"topic": section.topic, **asdict(one)} for section in sections for one in section.findings
    ]
    return {"ok": succeeded(sections), "counts": _counts(sections), "findings": rows}


def as_text(sections: Sequence[Section]) -> str:
    """Return lines for a person; the command that repairs a finding follows it."""
    lines = [line for section in sections for line in _section(section)]
    counts = _counts(sections)
    summary = ", ".join(f"{counts[level]} {level}" for level in FindingLevel)
    return "\n".join([*lines, summary])


def _counts(sections: Sequence[Section]) -> dict[str, int]:
    counted = Counter(one.level for section in sections for one in section.findings)
    return {level: counted[level] for level in FindingLevel}


def _section(section: Section) -> Iterator[str]:
    yield section.topic
    for finding in section.findings:
        yield from _lines(finding)
    yield ""


def _lines(finding: DoctorFinding) -> Iterator[str]:
    head = f"  {finding.level:<{len(FindingLevel.MISSING)}}  {finding.name:<{_NAME_COLUMNS}} "
    room = COLUMNS - _INDENT
    first, *rest = textwrap.wrap(finding.measured, room, break_on_hyphens=False) or [""]
    yield f"{head}{first}"
    yield from (" " * _INDENT + line for line in rest)
    if finding.remedy:
        yield from _remedy(finding.remedy)


def _remedy(remedy: str) -> Iterator[str]:
    """Keep a command in one line, however long: it is there to be copied."""
    line = f"{' ' * (_INDENT - len(_ARROW))}{_ARROW}{remedy}"
    if len(line) <= COLUMNS:
        yield line
        return
    command, _, comment = remedy.partition(_COMMENT)
    indent = _INDENT if _INDENT + len(command) <= COLUMNS else _LEAST_INDENT
    yield f"{' ' * (indent - len(_ARROW))}{_ARROW}{command}"
    margin = " " * indent
    yield from textwrap.wrap(comment, COLUMNS, initial_indent=margin, subsequent_indent=margin)
