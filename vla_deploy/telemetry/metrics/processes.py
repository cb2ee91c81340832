"""Declare what is measured of the processes, their budgets and the degradation ladder."""

from functools import partial
from typing import Final

from vla_deploy.supervisor.processes.lifecycle import ProcessState
from vla_deploy.telemetry.metrics.metric import (
    Metric,
    column,
    count_of,
    is_empty,
    share_of_limit,
)
from vla_deploy.telemetry.metrics.paths import Path, at, each, keys, path, rows, same

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
    return path(keys("rows"), rows({"process": "process"}, metric=metric))


_ALL_ROWS: Final = path(keys("rows"), rows({"process": "process", "resource": "metric"}))

METRICS: Final[tuple[Metric, ...]] = (
    _process(
        "vla_process_memory_bytes",
        "Memory of a process and of what it started: PSS, or RSS where PSS cannot be read.",
        _of_each("memory_mb"),
        scale=_MEGA,
        kept=True,
    ),
    _process(
        "vla_process_resident_memory_bytes",
        "Resident memory of a process and of what it started; shared pages count each time.",
        _of_each("rss_mb"),
        scale=_MEGA,
    ),
    _process(
        "vla_process_cpu_seconds_total",
        "CPU time of a process and of what it started, over all its restarts in this run.",
        _of_each("cpu_s"),
    ),
    _budget(
        "vla_process_cpu_cores",
        "Cores that a process used, mean of the last 2 s; total is the robot without a twin.",
        _rows_of("cpu_ratio"),
        take=column("measured"),
        kept=True,
    ),
    _process(
        "vla_process_state",
        "Where a process stands: 1 for its state, 0 for the others.",
        path(*_ROWS, keys("state")),
        states=tuple(state.value for state in ProcessState),
    ),
    _process(
        "vla_process_restarts_total",
        "How often a process was started again in this run.",
        path(*_ROWS, keys("restarts")),
        kept=True,
    ),
    _process(
        "vla_process_alarms",
        "How many of a process' topics are too old, too slow or not valid.",
        path(*_ROWS, keys("alarms")),
        take=count_of,
    ),
    _process(
        "vla_memory_peak_bytes",
        "Most memory that all processes together held in this run.",
        at("peak_memory_mb"),
        scale=_MEGA,
    ),
    _process(
        "vla_commands_taken",
        "1 while the robot takes commands, 0 while a process that it needs is given up.",
        at("refusal"),
        take=is_empty,
    ),
    _budget(
        "vla_process_memory_limit_bytes",
        "Memory that the profile grants a process; total is for the whole robot.",
        _rows_of("memory_mb"),
        take=column("limit"),
        scale=_MEGA,
    ),
    _budget(
        "vla_process_cpu_limit_cores",
        "Cores that the profile grants a process; total is for the whole robot.",
        _rows_of("cpu_ratio"),
        take=column("limit"),
    ),
    _budget(
        "vla_budget_used_ratio",
        "How much of a budget's line is used: above 1 the line is broken.",
        _ALL_ROWS,
        take=share_of_limit,
        kept=True,
    ),
    _budget(
        "vla_budget_over",
        "1 while a budget counts as broken, by the times that the profile declares.",
        _ALL_ROWS,
        take=column("over"),
    ),
    _budget(
        "vla_ladder_steps",
        "How many steps of the ladder are in force.",
        at("ladder.step"),
        kept=True,
    ),
    _budget(
        "vla_ladder_changes_total",
        "Steps of the ladder that were taken and undone in this run.",
        path(keys("ladder.counts"), same("change", "taken", "undone")),
    ),
    _budget("vla_budget_stop", "1 while a budget demands that the robot stops.", at("stop")),
    _directive(
        "vla_process_rate_ratio",
        "Share of its rate at which the ladder lets a process work; only those slowed down.",
        path(keys("rate_ratio"), each("process")),
    ),
)
