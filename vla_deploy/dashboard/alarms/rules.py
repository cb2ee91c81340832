"""List the alarm rules, which are pure functions of the robot's status."""

from collections.abc import Callable, Iterable, Iterator
from typing import Final

from vla_deploy.dashboard.alarms import control_rules, part_rules, process_rules
from vla_deploy.dashboard.alarms.alarm import AlarmFinding, AlarmSeverity, Key
from vla_deploy.dashboard.alarms.robot_status import RobotStatus

Rule = Callable[[RobotStatus], Iterator[AlarmFinding]]

RULES: Final[tuple[Rule, ...]] = (
    process_rules.silent_supervisor,
    process_rules.lost_processes,
    process_rules.odd_topics,
    process_rules.old_topics,
    control_rules.active_cause,
    control_rules.untimely_control,
    control_rules.troubled_buses,
    part_rules.exceeded_budgets,
    part_rules.steps_taken,
    part_rules.slow_twin,
    part_rules.hearing,
    part_rules.seeing,
    part_rules.planning,
    part_rules.place,
    part_rules.battery,
    part_rules.stop_door,
)


def find(robot: RobotStatus) -> dict[Key, AlarmFinding]:
    """Return the findings of all rules."""
    return {finding.key: finding for rule in RULES for finding in _findings_of(rule, robot)}


def _findings_of(rule: Rule, robot: RobotStatus) -> Iterable[AlarmFinding]:
    """Return what a rule finds; a rule that fails on its input is a finding itself."""
    try:
        return tuple(rule(robot))
    except (KeyError, TypeError, ValueError) as error:
        name = rule.__name__.replace("_", " ")
        found = AlarmFinding(
            process="dashboard",
            field=rule.__name__,
            text=f"nobody judges {name}: what is told has another form than expected ({error!r})",
            severity=AlarmSeverity.ERROR,
            advice="processes of two versions run beside each other: start the run anew",
        )
        return (found,)
