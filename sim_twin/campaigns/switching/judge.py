"""Judge switches: each by itself, late ticks and memory over all of them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from sim_twin.campaigns.growth import slope, warm
from sim_twin.campaigns.report import CampaignCase
from sim_twin.campaigns.ticks import TickWatch, late_limit, total

MOST_MIB_PER_SWITCH: Final = 0.05
"""A hundred switches may leave 5 MiB: allocators and caches never stand quite still."""
FEWEST_FOR_A_SLOPE: Final = 40
LEAST_RATE_RATIO: Final = 0.9
LEAST_MOTION_RAD: Final = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchSeen:
    """Hold what was measured across one switch; memory is each process' own, in MiB."""

    outcome: str
    reason: str
    seconds: float
    ticks: TickWatch
    least_rate_hz: float
    moved_rad: float
    states: frozenset[str]
    memory_mib: Mapping[str, float]
    cause: str = ""
    late_at_commit: int | None = None
    explained_at_commit: int = 0


def judge(seen: SwitchSeen, outcomes: Sequence[str], reason: str = "") -> Iterator[str]:
    """Return what was wrong with one switch; late ticks far from its commit count over all."""
    if seen.late_at_commit is not None and seen.late_at_commit > seen.explained_at_commit:
        yield (
            f"{seen.late_at_commit} ticks late in the second around the commit, the computer "
            f"explains {seen.explained_at_commit}"
        )
    if seen.outcome not in outcomes:
        yield f"{seen.outcome} ({seen.reason}), expected {' or '.join(outcomes)}"
    elif reason not in seen.reason:
        yield f"the reason is {seen.reason!r}, expected a word about {reason}"
    if seen.states != {"armed"}:
        strange = ", ".join(sorted(seen.states - {"armed"})) or "never looked at"
        yield f"control was {strange} {seen.cause}".rstrip()
    expected = LEAST_RATE_RATIO * seen.least_rate_hz * seen.seconds
    if seen.ticks.ticks < expected:
        yield f"{seen.ticks.ticks} ticks in {seen.seconds:.1f} s, expected {expected:.0f}"
    if seen.moved_rad < LEAST_MOTION_RAD:
        yield f"moved {seen.moved_rad:.3f} rad, expected {LEAST_MOTION_RAD} at least"


def slopes(history: Sequence[SwitchSeen]) -> dict[str, float]:
    """Return by how many MiB each process grows with a switch, after the warm-up."""
    judged = warm(history)
    if len(judged) < 2:
        return {}
    return {
        name: slope(range(len(judged)), [seen.memory_mib[name] for seen in judged])
        for name in judged[0].memory_mib
        if all(name in seen.memory_mib for seen in judged)
    }


def memory_case(history: Sequence[SwitchSeen]) -> CampaignCase:
    """Return the verdict about memory; too few switches give figures without a verdict."""
    found = slopes(history)
    enough = len(history) >= FEWEST_FOR_A_SLOPE
    failures = tuple(
        f"{name} grows by {growth:.3f} MiB per switch, limit {MOST_MIB_PER_SWITCH:g}"
        for name, growth in found.items()
        if enough and growth > MOST_MIB_PER_SWITCH
    )
    figures: dict[str, Any] = {f"{name}_mib_per_switch": growth for name, growth in found.items()}
    if not enough:
        figures["not_judged"] = f"{len(history)} switches, {FEWEST_FOR_A_SLOPE} are needed"
    return CampaignCase(name="memory", failures=failures, figures=figures)


def ticks_case(before: TickWatch, history: Sequence[SwitchSeen]) -> CampaignCase:
    """Return the verdict about late ticks across all switches."""
    during = total(seen.ticks for seen in history)
    limit = late_limit(before)
    failures = (
        (f"{during.late_ratio:.2%} of the ticks late, limit {limit:.2%}",)
        if during.late_ratio > limit
        else ()
    )
    figures = {
        "before_late_ratio": before.late_ratio,
        "late_ratio": during.late_ratio,
        "ticks": during.ticks,
        "late_ticks": during.late,
    }
    return CampaignCase(name="deadlines", failures=failures, figures=figures)
