"""Examine the computer and report what keeps the stack from running well, with the remedy."""

from vla_deploy.doctor.context import DoctorContext, live_context, recorded_context
from vla_deploy.doctor.finding import (
    DoctorFinding,
    FindingLevel,
    Section,
    as_document,
    as_text,
    succeeded,
)
from vla_deploy.doctor.table import CHECKS, examine

__all__ = [
    "CHECKS",
    "DoctorContext",
    "DoctorFinding",
    "FindingLevel",
    "Section",
    "as_document",
    "as_text",
    "examine",
    "live_context",
    "recorded_context",
    "succeeded",
]
