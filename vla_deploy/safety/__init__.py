"""Judge each control tick: pure functions from measurements to a verdict, no I/O."""

from vla_deploy.safety.causes import RULES, Cause, Latch, Reaction, ResetBy, Rule
from vla_deploy.safety.inputs import DriveSample, SafetyInputs, SafetyLimits
from vla_deploy.safety.judge import CLEAR, ResetOutcome, SafetyState, Verdict, evaluate

__all__ = [
    "CLEAR",
    "RULES",
    "Cause",
    "DriveSample",
    "Latch",
    "Reaction",
    "ResetBy",
    "ResetOutcome",
    "Rule",
    "SafetyInputs",
    "SafetyLimits",
    "SafetyState",
    "Verdict",
    "evaluate",
]
