"""`vla-deploy budget`: what the robot uses, its limits, and what is done about an excess."""

import argparse
import json
from typing import Any, Final

from vla_deploy.cli.commands import add_top_command
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.session import RobotSession, attach
from vla_deploy.cli.terminal import CLEAR_SCREEN, control
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.supervision import BudgetDocument, BudgetRow, LadderStepDocument

AGE_LIMIT_S: Final = 3.0
WATCH_PERIOD_S: Final = 1.0
UNITS: Final = {
    "memory_mb": "MB",
    "gpu_memory_mb": "MB",
    "disk_free_mb": "MB",
    "cpu_ratio": "cores",
    "power_w": "W",
    "temperature_c": "degC",
}


def register(commands: Any) -> None:
    """Add the command."""
    budget = add_top_command(
        commands,
        "budget",
        "  vla-deploy budget\n  vla-deploy budget --watch\n  vla-deploy budget --json\n",
        run,
        json_help="print everything as JSON",
    )
    budget.add_argument("--watch", action="store_true", help="go on until Ctrl-C")


def run(arguments: argparse.Namespace) -> int:
    """Print the budgets of the run on this machine."""
    session = attach(arguments.runtime_base)
    while True:
        budget = collect(session)
        if arguments.json:
            print(json.dumps(budget, indent=None if arguments.watch else 2), flush=True)
        else:
            if arguments.watch:
                control(CLEAR_SCREEN)
            print(as_text(budget), flush=True)
        if not arguments.watch:
            return 0
        session.pause(WATCH_PERIOD_S)


def collect(session: RobotSession) -> BudgetDocument:
    """Return the supervisor's report on the budgets.

    Raises:
        CommandFailed: there is none.
    """
    budget = session.document(topics.BUDGET, AGE_LIMIT_S)
    if budget is None:
        raise CommandFailed("the supervisor does not tell its budgets; see: vla-deploy status")
    return budget


def as_text(budget: BudgetDocument) -> str:
    """Return the budgets as lines for a person."""
    hint = [f"hint: {budget['hint']}"] if budget["hint"] else []
    return "\n".join([*_lines(budget), "", *_ladder(budget), "", *_enforced(budget), *hint])


def _lines(budget: BudgetDocument) -> list[str]:
    head = f"{'process':<12} {'metric':<14} {'used':>10} {'limit':>12} {'state':<8} reason"
    return [head, *(_line(row).rstrip() for row in budget["rows"])]


def _line(row: BudgetRow) -> str:
    used = "unknown" if row["measured"] is None else f"{row['measured']:g}"
    limit = f"{'>=' if row['at_least'] else '<='} {row['limit']:g}"
    name = f"{row['metric'].rpartition('_')[0]} {UNITS.get(row['metric'], '')}"
    return (
        f"{row['process'] or '(total)':<12} {name:<14} {used:>10} {limit:>12} "
        f"{row['state']:<8} {row['reason']}"
    )


def _ladder(budget: BudgetDocument) -> list[str]:
    ladder = budget["ladder"]
    in_force = [
        f"  {_step_words(one)}, for {one['since_s']:g} s: {one['why']}" for one in ladder["taken"]
    ]
    latest = [
        f"  {one['ago_s']:g} s ago {'took' if one['taken'] else 'undid'} {_step_words(one)}: "
        f"{one['why']}"
        for one in ladder["history"]
    ]
    return [
        f"ladder: {len(in_force)} steps in force" + (", protective stop" if budget["stop"] else ""),
        *in_force,
        *(["history:", *latest] if latest else []),
    ]


def _step_words(step: LadderStepDocument) -> str:
    words = step["action"].replace("_", " ")
    if step["process"]:
        words += f" {step['process']}"
    return f"{words} to {100 * step['ratio']:g} %" if step["action"] == "slow" else words


def _enforced(budget: BudgetDocument) -> list[str]:
    return [
        "enforced by:",
        *(
            f"  {row['process']:<12} {what}: {row[what]}"
            for row in budget["enforced"]
            for what in ("memory", "cpu")
        ),
    ]
