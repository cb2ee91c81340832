"""Find processes that are gone, that come and go, or that write too seldom or nonsense."""

from collections.abc import Iterator, Mapping
from typing import Final

from vla_deploy.dashboard.alarms.finding import Finding, Severity
from vla_deploy.dashboard.alarms.told import Document, Told
from vla_deploy.ipc import BY_NAME
from vla_deploy.supervisor.processes.lifecycle import ProcessState
from vla_deploy.supervisor.table import TABLE, GivingUp

GIVEN_UP: Final[Mapping[GivingUp, Severity]] = {
    GivingUp.END_RUN: Severity.CRITICAL,
    GivingUp.NO_COMMANDS: Severity.ERROR,
    GivingUp.CARRY_ON: Severity.WARNING,
}
_AGAIN: Final = (ProcessState.BACKOFF.value, ProcessState.ABORTING.value)
_WHAT_IT_MEANS: Final = {spec.name: spec.giving_up for spec in TABLE}


def silent_supervisor(told: Told) -> Iterator[Finding]:
    """Find a supervisor that no longer tells what runs: control stops the robot for it, too."""
    age_s, limit_s = told.age_s("process_table"), BY_NAME["process_table"].deadline_s
    if age_s is not None and age_s > limit_s:
        yield Finding(
            process="supervisor",
            field="process_table",
            text="the supervisor is silent: nobody restarts what fails",
            severity=Severity.CRITICAL,
            advice="vla-deploy status; where the run has ended, start it anew",
            measured=age_s,
            limit=limit_s,
            unit="s",
            age_s=age_s,
        )


def lost_processes(told: Told) -> Iterator[Finding]:
    """Find processes that were given up, and those that are being started again."""
    for row in _rows(told):
        if row["state"] == ProcessState.GIVEN_UP.value:
            yield _given_up(row)
        elif row["state"] in _AGAIN or _is_starting_again(row):
            yield _started_again(row)


def odd_topics(told: Told) -> Iterator[Finding]:
    """Find what the supervisor's watch says: too few values, and such as cannot be."""
    for row in _rows(told):
        for topic in row["topics"] if row["state"] == ProcessState.READY.value else ():
            yield from _seldom(row["name"], topic)
            yield from _nonsense(row["name"], topic)


def _rows(told: Told) -> tuple[Document, ...]:
    table = told.document("process_table")
    return () if table is None else tuple(table["processes"])


def _given_up(row: Document) -> Finding:
    meaning = _WHAT_IT_MEANS.get(row["name"], GivingUp.CARRY_ON)
    return Finding(
        process=row["name"],
        field="state",
        text=f"{row['name']} was given up: {row['reason']}; {meaning.value}",
        severity=GIVEN_UP[meaning],
        advice="look into vla-deploy crashes list, mend it, then start the run anew",
        measured=float(row["restarts"]),
        unit="restarts",
        rise_s=0.0,
    )


def _is_starting_again(row: Document) -> bool:
    return row["state"] == ProcessState.STARTING.value and bool(row["restarts"])


def _started_again(row: Document) -> Finding:
    return Finding(
        process=row["name"],
        field="restarts",
        text=f"{row['name']} is started again: {row['reason'] or 'it ended'}",
        severity=Severity.WARNING,
        advice=f"vla-deploy crashes list; vla-deploy logs {row['name']}",
        measured=float(row["restarts"]),
        unit="restarts",
        rise_s=0.0,
    )


def _seldom(process: str, topic: Document) -> Iterator[Finding]:
    rate_hz, least_hz = topic["rate_hz"], topic["least_hz"]
    if rate_hz is not None and rate_hz < least_hz:
        yield Finding(
            process=process,
            field=f"{topic['topic']} rate",
            text=f"{process} writes {topic['topic']} too seldom",
            severity=Severity.WARNING,
            advice="the computer is too busy, or the process hangs: vla-deploy budget",
            measured=rate_hz,
            limit=least_hz,
            unit="Hz",
            age_s=topic["age_s"],
        )


def _nonsense(process: str, topic: Document) -> Iterator[Finding]:
    for fault in topic["faults"]:
        yield Finding(
            process=process,
            field=topic["topic"],
            subject=fault.partition(":")[0],
            text=f"{process} writes what cannot be: {topic['topic']}.{fault}",
            severity=Severity.ERROR,
            advice=f"vla-deploy logs {process}",
            age_s=topic["age_s"],
        )
