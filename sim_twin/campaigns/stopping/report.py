"""Write the certificate of stops: one page for a browser, JSON, and a table in Markdown."""

import json
import os
import platform
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, StrictUndefined

from sim_twin.campaigns.report import CampaignCase, CampaignReport
from sim_twin.campaigns.suites.page import figure
from vla_deploy.doctor.software import PROJECT

PROFILE: Final = "desktop"
_TEMPLATE: Final = Path(__file__).with_name("certificate.html")
_COLUMNS: Final = (
    *("n", "in_motion", "category", "begun_s_max"),
    *("standstill_s_p50", "standstill_s_p99", "standstill_s_max"),
    *("base_m", "joint_rad", "residual_rad_s", "control", "physics"),
)
_WIRE_COLUMNS: Final = (
    "n",
    "left_out",
    "realtime",
    *(f"to_wire_s_{p}" for p in ("p50", "p99", "max")),
)
_KILL_COLUMNS: Final = ("rest_s", "ready_s", "state", "motion", "moved_rad")
_GIT_S: Final = 10.0


@dataclass(frozen=True, kw_only=True)
class StopReport(CampaignReport):
    """Hold what was stopped and how it went, by which command of which version."""

    command: str
    robot: str
    seed: int

    @cached_property
    def facts(self) -> Mapping[str, str]:
        """Return by what and on what this was measured; no name of a host."""
        return {
            "version": metadata.version(PROJECT),
            "commit": _commit(),
            "robot": self.robot,
            "profile": PROFILE,
            "seed": str(self.seed),
            "machine": f"{platform.machine()}, {os.cpu_count()} cores, "
            f"{platform.system()} {platform.release()}, Python {platform.python_version()}",
            "load average at the end": f"{os.getloadavg()[0]:.1f}",
            "command": self.command,
        }

    @property
    def tables(self) -> Mapping[str, tuple[tuple[str, ...], list[CampaignCase]]]:
        """Return columns and cases of each kind that was played."""
        played = [case for case in self.cases if not case.skipped]
        wire = [case for case in played if case.name.startswith("wire/")]
        killed = [case for case in played if "SIGKILL" in case.name]
        rest = [case for case in played if case not in wire and case not in killed]
        return {
            "To standstill, in the twin's time, judged by physics": (_COLUMNS, rest),
            "From the request to the frame on the wire, by the wall clock": (_WIRE_COLUMNS, wire),
            "Processes killed, in the twin's time, judged by physics": (_KILL_COLUMNS, killed),
        }

    @property
    def not_tried(self) -> Mapping[str, list[str]]:
        """Return the cells that were not played by the reason."""
        reasons = dict.fromkeys(case.skipped for case in self.skipped)
        return {why: [case.name for case in self.skipped if case.skipped == why] for why in reasons}

    def text(self) -> str:
        """Return what was summed up, for people."""
        lines = [f"{name:32} {figure(value)}" for name, value in self.summary.items()]
        lines += [case.row for case in self.failed]
        lines += [f"{len(names)} cells {why}" for why, names in self.not_tried.items()]
        counts = f"{len(self.failed)} failed, {len(self.skipped)} not tried"
        return "\n".join([*lines, f"{self.campaign}: {len(self.cases)} cells, {counts}"])

    def document(self) -> dict[str, Any]:
        """Return the report as JSON, with what it was measured by."""
        return {"facts": dict(self.facts), **CampaignReport.document(self)}

    def write(self, folder: Path) -> None:
        """Write `stops.html`, `stops.json` and `stops.md` into a folder."""
        text = json.dumps(self.document(), indent=2)
        (folder / "stops.json").write_text(text + "\n", encoding="utf-8")
        (folder / "stops.html").write_text(self.page(), encoding="utf-8")
        (folder / "stops.md").write_text(self.markdown() + "\n", encoding="utf-8")

    def page(self) -> str:
        """Return a page that asks no server for anything."""
        environment = Environment(
            autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
        )
        environment.filters["figure"] = figure
        template = environment.from_string(_TEMPLATE.read_text(encoding="utf-8"))
        return template.render(report=self, verdict=verdict)

    def markdown(self) -> str:
        """Return the same as tables of a text."""
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield from (f"- {name}: {value}" for name, value in self.facts.items())
        yield from ("", ", ".join(f"{name} {figure(one)}" for name, one in self.summary.items()))
        for title, (columns, cases) in self.tables.items():
            if cases:
                yield from ("", f"**{title}**", "", _row("cell", *columns, "verdict"))
                yield _row(*("---" for _ in (*columns, 0, 0)))
                for case in cases:
                    values = (figure(case.figures.get(column)) for column in columns)
                    yield _row(case.name, *values, verdict(case))
        if self.failed:
            yield from ("", "**Failed**", "")
            yield from (f"- {case.name}: {'; '.join(case.failures[:3])}" for case in self.failed)
        if self.skipped:
            yield from ("", "**Not tried**", "")
            yield from (f"- {', '.join(names)}: {why}" for why, names in self.not_tried.items())


def verdict(case: CampaignCase) -> str:
    """Return how a cell went."""
    if case.skipped:
        return "not tried"
    return "FAILED" if case.failures else "VERIFIED"


def _row(*values: str) -> str:
    return f"| {' | '.join(values)} |"


def _commit() -> str:
    """Return which commit this is, where it lies in a repository."""
    try:
        done = subprocess.run(
            ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty"],
            capture_output=True,
            text=True,
            timeout=_GIT_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return "unknown"
    return done.stdout.strip() or "unknown"
