"""Declare what is measured of the processes, their budgets and the ladder."""

from typing import Final

from vla_deploy.supervisor.processes.lifecycle import ProcessState
from vla_deploy.telemetry.metrics.kinds import Kind, Metric
from vla_deploy.telemetry.metrics.paths import Each, Named, Path, Rows, keys, same
from vla_deploy.telemetry.metrics.takes import column, count_of, is_empty, share_of_limit

_MEGA: Final = 1e6
_ROWS: Final[Path] = (keys("processes"), Rows({"process": "name"}))


def _of_each(*path: str) -> tuple[Path, ...]:
    """Lead to one number of every process, the supervisor among them."""
    inside = keys(".".join(path))
    return (*_ROWS, inside), (Named("supervisor", "process", "supervisor"), inside)


def _budget(metric: str) -> tuple[Path, ...]:
    """Lead to the rows of one kind of budget."""
    return ((keys("rows"), Rows({"process": "process"}, where=(("metric", metric),))),)


_ALL_ROWS: Final = ((keys("rows"), Rows({"process": "process", "resource": "metric"})),)

METRICS: Final[tuple[Metric, ...]] = (
    Metric(
        name="vla_process_memory_bytes",
        kind=Kind.GAUGE,
        unit="bytes",
        help="Memory of a process and of what it started: PSS, or RSS where PSS cannot be read.",
        topic="process_table",
        paths=_of_each("memory_mb"),
        scale=_MEGA,
        kept=True,
    ),
    Metric(
        name="vla_process_resident_memory_bytes",
        kind=Kind.GAUGE,
        unit="bytes",
        help="Resident memory of a process and of what it started; shared pages count each time.",
        topic="process_table",
        paths=_of_each("rss_mb"),
        scale=_MEGA,
    ),
    Metric(
        name="vla_process_cpu_seconds_total",
        kind=Kind.COUNTER,
        unit="seconds",
        help="CPU time of a process and of what it started, over all its restarts in this run.",
        topic="process_table",
        paths=_of_each("cpu_s"),
    ),
    Metric(
        name="vla_process_cpu_cores",
        kind=Kind.GAUGE,
        unit="cores",
        help="Cores that a process used, mean of the last 2 s; total is the robot without a twin.",
        topic="budget",
        paths=_budget("cpu_ratio"),
        take=column("measured"),
        kept=True,
    ),
    Metric(
        name="vla_process_state",
        kind=Kind.STATES,
        help="Where a process stands: 1 for its state, 0 for the others.",
        topic="process_table",
        paths=((*_ROWS, keys("state")),),
        states=tuple(state.value for state in ProcessState),
    ),
    Metric(
        name="vla_process_restarts_total",
        kind=Kind.COUNTER,
        help="How often a process was started again in this run.",
        topic="process_table",
        paths=((*_ROWS, keys("restarts")),),
        kept=True,
    ),
    Metric(
        name="vla_process_alarms",
        kind=Kind.GAUGE,
        help="How many of a process' topics are too old, too slow or not valid.",
        topic="process_table",
        paths=((*_ROWS, keys("alarms")),),
        take=count_of,
    ),
    Metric(
        name="vla_memory_peak_bytes",
        kind=Kind.GAUGE,
        unit="bytes",
        help="Most memory that all processes together held in this run.",
        topic="process_table",
        paths=((keys("peak_memory_mb"),),),
        scale=_MEGA,
    ),
    Metric(
        name="vla_commands_taken",
        kind=Kind.GAUGE,
        help="1 while the robot takes commands, 0 while a process that it needs is given up.",
        topic="process_table",
        paths=((keys("refusal"),),),
        take=is_empty,
    ),
    Metric(
        name="vla_process_memory_limit_bytes",
        kind=Kind.GAUGE,
        unit="bytes",
        help="Memory that the profile grants a process; total is for the whole robot.",
        topic="budget",
        paths=_budget("memory_mb"),
        take=column("limit"),
        scale=_MEGA,
    ),
    Metric(
        name="vla_process_cpu_limit_cores",
        kind=Kind.GAUGE,
        unit="cores",
        help="Cores that the profile grants a process; total is for the whole robot.",
        topic="budget",
        paths=_budget("cpu_ratio"),
        take=column("limit"),
    ),
    Metric(
        name="vla_budget_used_ratio",
        kind=Kind.GAUGE,
        unit="ratio",
        help="How much of a budget's line is used: above 1 the line is broken.",
        topic="budget",
        paths=_ALL_ROWS,
        take=share_of_limit,
        kept=True,
    ),
    Metric(
        name="vla_budget_over",
        kind=Kind.GAUGE,
        help="1 while a budget counts as broken, by the times that the profile declares.",
        topic="budget",
        paths=_ALL_ROWS,
        take=column("over"),
    ),
    Metric(
        name="vla_ladder_steps",
        kind=Kind.GAUGE,
        help="How many steps of the ladder are in force.",
        topic="budget",
        paths=((keys("ladder.step"),),),
        kept=True,
    ),
    Metric(
        name="vla_ladder_changes_total",
        kind=Kind.COUNTER,
        help="Steps of the ladder that were taken and undone in this run.",
        topic="budget",
        paths=((keys("ladder.counts"), same("change", "taken", "undone")),),
    ),
    Metric(
        name="vla_budget_stop",
        kind=Kind.GAUGE,
        help="1 while a budget demands that the robot stops.",
        topic="budget",
        paths=((keys("stop"),),),
    ),
    Metric(
        name="vla_process_rate_ratio",
        kind=Kind.GAUGE,
        unit="ratio",
        help="Share of its rate at which the ladder lets a process work; only those slowed down.",
        topic="resource_directives",
        paths=((keys("rate_ratio"), Each("process")),),
    ),
)
