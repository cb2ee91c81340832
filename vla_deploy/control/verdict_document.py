"""Put a verdict into the words and numbers of `control_status`."""

import math
from typing import Any

from vla_deploy.safety import Cause, Verdict


def verdict_document(verdict: Verdict) -> dict[str, Any]:
    """Return who stops or slows the robot and by which numbers; null where none applies."""
    return {
        "cause": "" if verdict.cause is Cause.NONE else verdict.cause.value,
        "reaction": verdict.reaction.name.lower(),
        "subject": verdict.subject,
        "measured": _number(verdict.measured),
        "limit": _number(verdict.limit),
        "age_s": _number(verdict.age_s),
        "speed_ratio": verdict.speed_ratio,
        "blocked": sorted(verdict.blocked),
    }


def _number(value: float) -> float | None:
    return round(value, 6) if math.isfinite(value) else None
