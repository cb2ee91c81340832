"""Say what a probe has found: who, what was measured, what was allowed, how old that is."""

from collections.abc import Callable
from dataclasses import dataclass

from vla_deploy.safety.inputs import Flags, Floats, SafetyInputs, SafetyLimits
from vla_deploy.safety.surroundings import Direction


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Hold one cause's numbers; NaN where no number applies.

    `speed_ratio` and `blocked` bound the base where the reaction leaves it moving.
    """

    subject: str
    measured: float = float("nan")
    limit: float = float("nan")
    age_s: float = 0.0
    speed_ratio: float = 1.0
    blocked: frozenset[Direction] = frozenset()


Probe = Callable[[SafetyInputs, SafetyLimits], Finding | None]


def first_joint(
    mask: Flags, measured: Floats, limit: Floats, age_s: Floats, limits: SafetyLimits
) -> Finding | None:
    """Return the finding of the first joint that a mask names."""
    joint = first_in(mask)
    return None if joint is None else joint_finding(joint, measured, limit, age_s, limits)


def first_in(mask: Flags) -> int | None:
    """Return the place of the first joint that a mask names."""
    place = mask.tobytes().find(1)  # on a few joints, several times faster than numpy itself
    return None if place < 0 else place


def joint_finding(
    joint: int, measured: Floats, limit: Floats, age_s: Floats, limits: SafetyLimits
) -> Finding:
    """Return what is found at one joint."""
    return Finding(
        subject=limits.joint_names[joint],
        measured=float(measured[joint]),
        limit=float(limit[joint]),
        age_s=float(age_s[joint]),
    )


def stale(subject: str, age_s: float | None, limit_s: float) -> Finding | None:
    """Find what is older than allowed; what never came cannot be."""
    if age_s is None or age_s <= limit_s:
        return None
    return Finding(subject=subject, measured=age_s, limit=limit_s, age_s=age_s)
