"""Report a campaign's cases as a table, as JSON and as JUnit XML."""

import errno
import functools
import json
import os
import traceback
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar
from xml.etree import ElementTree

from sim_twin.campaigns.selection import OptionRefused

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignCase:
    """Hold one case: no `failures` means that all was as it must be; `figures` are for tables.

    `skipped` is why the case was not played.
    """

    name: str
    failures: tuple[str, ...] = ()
    skipped: str = ""
    figures: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def row(self) -> str:
        """Return one line for a table."""
        figures = "  ".join(f"{name} {_short(value)}" for name, value in self.figures.items())
        verdict = "FAILED: " + "; ".join(self.failures) if self.failures else "ok"
        if self.skipped:
            verdict = f"skipped: {self.skipped}"
        return f"{self.name:44} {verdict:6} {figures}".rstrip()


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignReport:
    """Hold what a campaign found."""

    campaign: str
    cases: tuple[CampaignCase, ...]
    summary: Mapping[str, Any] = field(default_factory=dict)

    @property
    def failed(self) -> tuple[CampaignCase, ...]:
        """Return the cases that failed."""
        return tuple(case for case in self.cases if case.failures)

    @property
    def passed(self) -> bool:
        """Return whether all was as it must be."""
        return not self.failed

    @property
    def skipped(self) -> tuple[CampaignCase, ...]:
        """Return the cases that could not be played."""
        return tuple(case for case in self.cases if case.skipped)

    def document(self) -> dict[str, Any]:
        """Return the report as JSON."""
        head = {
            "campaign": self.campaign,
            "cases": len(self.cases),
            "failed": len(self.failed),
            "skipped": len(self.skipped),
        }
        return {**head, **self.summary, "results": [asdict(case) for case in self.cases]}

    def text(self) -> str:
        """Return what was summed up, for people."""
        lines = [f"{name:32} {_short(value)}" for name, value in self.summary.items()]
        lines += [case.row for case in (*self.skipped, *self.failed)]
        sums = f"{len(self.cases)} cases, {len(self.failed)} failed, {len(self.skipped)} skipped"
        lines += [f"{self.campaign}: {sums}"]
        return "\n".join(lines)

    def write_junit(self, path: Path) -> None:
        """Write the cases in the JUnit format, which CI servers read."""
        counts = {
            "name": self.campaign,
            "tests": str(len(self.cases)),
            "failures": str(len(self.failed)),
            "errors": "0",
            "skipped": str(len(self.skipped)),
        }
        root = ElementTree.Element("testsuites")
        node = ElementTree.SubElement(root, "testsuite", counts)
        for case in self.cases:
            seconds = f"{case.seconds:.3f}"
            child = ElementTree.SubElement(
                node, "testcase", classname=self.campaign, name=case.name, time=seconds
            )
            for failure in case.failures:
                ElementTree.SubElement(child, "failure", message=failure)
            if case.skipped:
                ElementTree.SubElement(child, "skipped", message=case.skipped)
            ElementTree.SubElement(child, "system-out").text = json.dumps(case.figures)
        ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


CaseT = TypeVar("CaseT", bound=CampaignCase)


def told(case: CaseT, tell: Callable[[str], None]) -> CaseT:
    """Report a case as soon as it is over, and return it."""
    tell(case.row)
    return case


def crash_is_failure(
    play: Callable[Concatenate[T, P], CampaignCase],
) -> Callable[Concatenate[T, P], CampaignCase]:
    """Let a case whose play raises have failed: the others are played all the same.

    The case is the first argument, by its name or with one. The traceback goes to the error output.
    """

    @functools.wraps(play)
    def judged(case: T, /, *arguments: P.args, **options: P.kwargs) -> CampaignCase:
        try:
            return play(case, *arguments, **options)
        except Exception as error:  # whatever it is, hours of other cases must not be lost by it
            traceback.print_exception(error)
            why = f"crashed: {type(error).__name__}: {error}"
            return CampaignCase(name=str(getattr(case, "name", case)), failures=(why,))

    return judged


class NoRoom(OptionRefused):
    """Say why no report can be written where an option wants it."""


def make_room(option: str, path: Path) -> None:
    """Make the folder of a report before anything is played: hours later it is too late.

    Raises:
        NoRoom: it cannot be made, or no file can be written there.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, "it is a folder", str(path))
        if not os.access(path if path.exists() else path.parent, os.W_OK):
            raise PermissionError(errno.EACCES, "it cannot be written", str(path))
    except OSError as error:
        raise NoRoom(f"{option} {path}: {error.strerror}: {error.filename}") from error


def _short(value: object) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
