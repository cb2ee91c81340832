"""Hold one line of the doctor: what was measured, how good it is, the command that mends it."""

from dataclasses import dataclass
from enum import StrEnum


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
