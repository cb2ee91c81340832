"""Write what the doctor found: for a person, by topic, within 100 columns; or as a document."""

import textwrap
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any, Final

from vla_deploy.doctor.finding import DoctorFinding, FindingLevel
from vla_deploy.doctor.table import Section

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
    """Return lines for a person; under each trouble stands the command that mends it."""
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
    """Keep a command whole, even where it is long: it is there to be copied."""
    line = f"{' ' * (_INDENT - len(_ARROW))}{_ARROW}{remedy}"
    if len(line) <= COLUMNS:
        yield line
        return
    command, _, comment = remedy.partition(_COMMENT)
    indent = _INDENT if _INDENT + len(command) <= COLUMNS else _LEAST_INDENT
    yield f"{' ' * (indent - len(_ARROW))}{_ARROW}{command}"
    margin = " " * indent
    yield from textwrap.wrap(comment, COLUMNS, initial_indent=margin, subsequent_indent=margin)
