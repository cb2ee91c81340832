"""List every rule by which conditions are found: pure functions of what was told."""

from collections.abc import Callable, Iterable, Iterator
from typing import Final

from vla_deploy.dashboard.alarms import (
    budget_rules,
    bus_rules,
    control_rules,
    part_rules,
    process_rules,
    topic_rules,
)
from vla_deploy.dashboard.alarms.finding import Finding, Key, Severity
from vla_deploy.dashboard.alarms.told import Told

Rule = Callable[[Told], Iterator[Finding]]

RULES: Final[tuple[Rule, ...]] = (
    process_rules.silent_supervisor,
    process_rules.lost_processes,
    process_rules.odd_topics,
    topic_rules.old_topics,
    control_rules.active_cause,
    control_rules.untimely_control,
    bus_rules.troubled_buses,
    budget_rules.exceeded_budgets,
    budget_rules.steps_taken,
    budget_rules.slow_twin,
    part_rules.hearing,
    part_rules.seeing,
    part_rules.planning,
    part_rules.place,
    part_rules.stop_door,
)


def find(told: Told) -> dict[Key, Finding]:
    """Return every condition that holds."""
    return {finding.key: finding for rule in RULES for finding in _judged(rule, told)}


def _judged(rule: Rule, told: Told) -> Iterable[Finding]:
    """Return what a rule finds; one that does not understand what it reads is found itself."""
    try:
        return tuple(rule(told))
    except (KeyError, TypeError, ValueError) as error:
        name = rule.__name__.replace("_", " ")
        found = Finding(
            process="dashboard",
            field=rule.__name__,
            text=f"nobody judges {name}: what is told has another form than expected ({error!r})",
            severity=Severity.ERROR,
            advice="processes of two versions run beside each other: start the run anew",
        )
        return (found,)
