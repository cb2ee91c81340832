"""Declare what is measured of the processes, their budgets and the degradation ladder."""

from functools import partial
from typing import Final

from vla_deploy.supervisor.lifecycle import State
from vla_deploy.telemetry.metrics.metric import (
    Metric,
    column,
    count_of,
    is_empty,
    share_of_limit,
)
from vla_deploy.telemetry.metrics.paths import Path, each, keys, rows, same

_process = partial(Metric, topic="process_table")
_budget = partial(Metric, topic="budget")
_directive = partial(Metric, topic="resource_directives")
_MEGA: Final = 1e6
_ROWS: Final[Path] = (keys("processes"), rows({"process": "name"}))


def _of_each(key: str) -> tuple[Path, ...]:
    """Return the paths to one number of every process, the supervisor among them."""
    return (*_ROWS, keys(key)), (same("process", "supervisor"), keys(key))


def _rows_of(metric: str) -> tuple[Path, ...]:
    """Return the path to the rows of one kind of budget."""
    return ((keys("rows"), rows({"process": "process"}, metric=metric)),)


_ALL_ROWS: Final = ((keys("rows"), rows({"process": "process", "resource": "metric"})),)

METRICS: Final[tuple[Metric, ...]] = (
    _process(
        name="vla_process_memory_bytes",
        help="Memory of a process and of what it started: PSS, or RSS where PSS cannot be read.",
        paths=_of_each("memory_mb"),
        scale=_MEGA,
        kept=True,
    ),
    _process(
        name="vla_process_resident_memory_bytes",
        help="Resident memory of a process and of what it started; shared pages count each time.",
        paths=_of_each("rss_mb"),
        scale=_MEGA,
    ),
    _process(
        name="vla_process_cpu_seconds_total",
        help="CPU time of a process and of what it started, over all its restarts in this run.",
        paths=_of_each("cpu_s"),
    ),
    _budget(
        name="vla_process_cpu_cores",
        help="Cores that a process used, mean of the last 2 s; total is the robot without a twin.",
        paths=_rows_of("cpu_ratio"),
        take=column("measured"),
        kept=True,
    ),
    _process(
        name="vla_process_state",
        help="Where a process stands: 1 for its state, 0 for the others.",
        paths=((*_ROWS, keys("state")),),
        states=tuple(state.value for state in State),
    ),
    _process(
        name="vla_process_restarts_total",
        help="How often a process was started again in this run.",
        paths=((*_ROWS, keys("restarts")),),
        kept=True,
    ),
    _process(
        name="vla_process_alarms",
        help="How many of a process' topics are too old, too slow or not valid.",
        paths=((*_ROWS, keys("alarms")),),
        take=count_of,
    ),
    _process(
        name="vla_memory_peak_bytes",
        help="Most memory that all processes together held in this run.",
        paths=((keys("peak_memory_mb"),),),
        scale=_MEGA,
    ),
    _process(
        name="vla_commands_taken",
        help="1 while the robot takes commands, 0 while a process that it needs is given up.",
        paths=((keys("refusal"),),),
        take=is_empty,
    ),
    _budget(
        name="vla_process_memory_limit_bytes",
        help="Memory that the profile grants a process; total is for the whole robot.",
        paths=_rows_of("memory_mb"),
        take=column("limit"),
        scale=_MEGA,
    ),
    _budget(
        name="vla_process_cpu_limit_cores",
        help="Cores that the profile grants a process; total is for the whole robot.",
        paths=_rows_of("cpu_ratio"),
        take=column("limit"),
    ),
    _budget(
        name="vla_budget_used_ratio",
        help="How much of a budget's line is used: above 1 the line is broken.",
        paths=_ALL_ROWS,
        take=share_of_limit,
        kept=True,
    ),
    _budget(
        name="vla_budget_over",
        help="1 while a budget counts as broken, by the times that the profile declares.",
        paths=_ALL_ROWS,
        take=column("over"),
    ),
    _budget(
        name="vla_ladder_steps",
        help="How many steps of the ladder are in force.",
        paths=((keys("ladder.step"),),),
        kept=True,
    ),
    _budget(
        name="vla_ladder_changes_total",
        help="Steps of the ladder that were taken and undone in this run.",
        paths=((keys("ladder.counts"), same("change", "taken", "undone")),),
    ),
    _budget(
        name="vla_budget_stop",
        help="1 while a budget demands that the robot stops.",
        paths=((keys("stop"),),),
    ),
    _directive(
        name="vla_process_rate_ratio",
        help="Share of its rate at which the ladder lets a process work; only those slowed down.",
        paths=((keys("rate_ratio"), each("process")),),
    ),
)
