"""Judge what one trouble led to."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sim_twin.campaigns.pressing.troubles import Trouble
from sim_twin.campaigns.ticks import TickWatch, late_limit


@dataclass(frozen=True, slots=True, kw_only=True)
class TroubleSeen:
    """Hold what one trouble led to; NaN is what never came.

    `states` are those in which control was, each with what control said the first time.
    """

    taken: tuple[str, ...]
    undone: tuple[str, ...]
    metrics_over: frozenset[str]
    before: TickWatch
    during: TickWatch
    after: TickWatch
    states: Mapping[str, str]
    replaced: frozenset[str]
    crashed: tuple[str, ...]
    hazards: tuple[str, ...]
    steps_s: float
    service_s: float


def judge(trouble: Trouble, seen: TroubleSeen) -> Iterator[str]:
    """Return what was not as declared."""
    if seen.taken != trouble.steps:
        yield f"steps taken: {listed(seen.taken)}; expected {listed(trouble.steps)}"
    if seen.undone != tuple(reversed(seen.taken)):
        yield f"steps undone: {listed(seen.undone)}; expected those taken, the last one first"
    if trouble.metric and trouble.metric not in seen.metrics_over:
        yield f"{trouble.metric} was never told to be over its budget"
    if not seen.steps_s <= trouble.steps_s:
        yield f"the last step after {seen.steps_s:.1f} s, limit {trouble.steps_s:g} s"
    if not seen.service_s <= trouble.service_s:
        yield f"full service after {seen.service_s:.1f} s, limit {trouble.service_s:g} s"
    for what, ticks in (("during it", seen.during), ("after it", seen.after)):
        limit = late_limit(seen.before)
        if ticks.late_ratio > limit:
            yield f"{ticks.late_ratio:.2%} of the ticks late {what}, limit {limit:.2%}"
    for state in sorted(set(seen.states) - set(trouble.states)):
        yield f"control was {state} ({seen.states[state]})"
    if ended := seen.replaced - set(trouble.replaced):
        yield f"{', '.join(sorted(ended))} ended"
    if crashed := sorted(set(seen.crashed) - set(trouble.replaced)):
        yield f"crash reports of {', '.join(crashed)}"
    yield from seen.hazards


def steps_of(history: Sequence[Mapping[str, Any]], *, taken: bool) -> tuple[str, ...]:
    """Return the steps that a ladder's history tells were taken, or undone, in their order."""
    return tuple(
        " ".join(filter(None, (row["action"], row["process"])))
        for row in history
        if row["taken"] is taken
    )


def listed(steps: Sequence[str]) -> str:
    """Return steps in words."""
    return ", ".join(steps) or "none"
