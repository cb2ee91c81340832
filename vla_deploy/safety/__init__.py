"""Judge each control tick: pure functions from measurements to a verdict, no I/O."""

from vla_deploy.safety.causes import RULES, Cause, CauseRule, Latch, Reaction
from vla_deploy.safety.inputs import DriveSample, SafetyInputs, SafetyLimits
from vla_deploy.safety.judge import CLEAR, ResetOutcome, SafetyState, Verdict, evaluate
from vla_deploy.safety.surroundings import (
    NOTHING_KNOWN,
    Clearance,
    Direction,
    Excess,
    KeepOut,
    Surroundings,
    ZoneFinding,
    ZoneKind,
)

__all__ = [
    "CLEAR",
    "NOTHING_KNOWN",
    "RULES",
    "Cause",
    "CauseRule",
    "Clearance",
    "Direction",
    "DriveSample",
    "Excess",
    "KeepOut",
    "Latch",
    "Reaction",
    "ResetOutcome",
    "SafetyInputs",
    "SafetyLimits",
    "SafetyState",
    "Surroundings",
    "Verdict",
    "ZoneFinding",
    "ZoneKind",
    "evaluate",
]
