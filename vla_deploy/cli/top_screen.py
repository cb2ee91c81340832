"""Lay out what the robot does on one screen of 80 by 24, in words that need no colour."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from vla_deploy.cli.status import twin_words

Told = Mapping[str, Any]
_BAD: Final = "bold red"
_POOR: Final = "yellow"
_GOOD: Final = "green"
_STYLES: Final = {"armed": _GOOD, "disarmed": "", "protective_stop": _POOR}
_LATE_TOPICS: Final = 3


def screen(told: Told) -> RenderableType:
    """Return the whole screen; what is silent says so."""
    return Group(
        _head(told), _safety(told), _work(told), _processes(told), _ticks(told), *_below(told)
    )


def _head(told: Told) -> Text:
    table = told["process_table"]
    if table is None:
        return Text("the supervisor is silent", style=_BAD)
    pace = told["twin_status"]
    how_fast = f" {twin_words(pace)}" if pace else ""
    twin = f", twin{how_fast}" if table["twin"] else ""
    refusal = f"  NO COMMANDS: {table['refusal']}" if table["refusal"] else ""
    words = Text(f"{table['robot']} on {table['profile']}{twin}", style="bold")
    return words.append(refusal, style=_BAD)


def _safety(told: Told) -> Text:
    control = told["control_status"]
    if control is None:
        return Text("safety: control is silent", style=_BAD)
    words = Text("safety: ").append(control["state"], style=_STYLES.get(control["state"], _BAD))
    if control["estop_latched"]:
        words.append(", EMERGENCY STOP LATCHED", style=_BAD)
    if control["cause"]:
        words.append(f", {control['cause']} {control['subject']}{_by_how_much(control)}", _POOR)
    return words


def _by_how_much(control: Told) -> str:
    if control["measured"] is None or control["limit"] is None:
        return ""
    age = f", {control['age_s']:.2f} s ago" if control["age_s"] is not None else ""
    return f" ({control['measured']:g}, limit {control['limit']:g}{age})"


def _work(told: Told) -> Text:
    executor, planner = told["executor_status"], told["planner_status"]
    if executor is None:
        return Text("work: the executor is silent", style=_POOR)
    doing = f"{executor['skill']} of {executor['command_id']}" if executor["skill"] else "nothing"
    waiting = len(planner["commands"]) if planner else 0
    asks = f"; asks: {planner['question']}" if planner and planner["question"] else ""
    return Text(f"work: {doing}; {waiting} being planned{asks}")


def _processes(told: Told) -> RenderableType:
    grid = Table(box=None, padding=(0, 1), pad_edge=False)
    for name in ("process", "state", "restarts", "cores", "of", "MB", "of"):
        grid.add_column(name, justify="left" if name in ("process", "state") else "right")
    limits = _budgets(told["budget"])
    for row in told["process_table"]["processes"] if told["process_table"] else ():
        cpu, memory = limits.get((row["name"], "cpu_ratio")), limits.get((row["name"], "memory_mb"))
        style = "" if row["state"] in ("ready", "off") and not row["alarms"] else _POOR
        grid.add_row(
            Text(row["name"], style),
            Text(row["state"] + (" !" if row["alarms"] else ""), style),
            str(row["restarts"]),
            *_used(cpu, row["cpu_ratio"], ".2f"),
            *_used(memory, row["memory_mb"], ".0f"),
        )
    return grid


def _budgets(budget: Told | None) -> dict[tuple[str, str], Told]:
    return {(row["process"], row["metric"]): row for row in budget["rows"]} if budget else {}


def _used(row: Told | None, otherwise: float | None, form: str) -> tuple[Text, str]:
    """Return what is used and its limit; a broken one is marked by more than a colour."""
    measured = otherwise if row is None or row["measured"] is None else row["measured"]
    if measured is None:
        return Text("-"), "-"
    is_over = row is not None and measured > row["limit"]
    used = Text(format(measured, form) + ("!" if is_over else ""), _BAD if is_over else "")
    return used, "-" if row is None else format(row["limit"], form)


def _ticks(told: Told) -> Text:
    control = told["control_status"]
    if control is None:
        return Text("")
    late = control["late_ticks"] / max(control["tick"], 1)
    words = f"control: {1 / control['period_s']:.0f} Hz, {control['late_ticks']} of "
    return Text(f"{words}{control['tick']} ticks late ({100 * late:.2f} %)")


def _below(told: Told) -> Iterator[Text]:
    control = told["control_status"]
    for name, bus in (control["buses"] if control else {}).items():
        yield Text(f"bus {name}: {_bus_words(bus)}")
    budget = told["budget"]
    if budget:
        steps = [f"{one['action']} {one['process'] or ''}" for one in budget["ladder"]["taken"]]
        yield Text(f"ladder: {', '.join(steps) or 'no steps in force'}", _POOR if steps else "")
    late = told["late_topics"]
    shown = [f"{one['topic']} {one['age_s']:.1f} s" for one in late[:_LATE_TOPICS]]
    more = f" and {len(late) - _LATE_TOPICS} more" if len(late) > _LATE_TOPICS else ""
    yield Text(f"topics: {told['topics']} written, late: {', '.join(shown) or 'none'}{more}")


def _bus_words(bus: Told) -> str:
    latency = bus.get("latency")
    wrong = ("timeouts", "crc_errors", "error_frames", "dropped", "link_lost", "lost_nodes")
    counts = [f"{name} {bus[name]}" for name in wrong if bus.get(name)]
    answers = f"answers p99 {1000 * latency['p99_s']:.1f} ms, " if latency else ""
    return f"{answers}{', '.join(counts) or 'no errors'}"
