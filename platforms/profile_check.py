"""Check what the values of a profile promise together."""

from collections import Counter
from collections.abc import Callable, Iterator
from typing import Final

from platforms.ladder import LadderAction
from platforms.profile_schema import ProfileFault
from platforms.profile_source import Table

MIN_WATCHDOG_PERIODS: Final = 3
_STAND_IN: Final = "twin"  # it stands for the world, and is not on a real robot
# Whoever keeps the robot safe is never slowed, suspended or restarted for want of resources.
_SPARED: Final = ("supervisor", "control", _STAND_IN)
# Whose models a process loads in tiers; the others have none to make smaller.
_TIERED_ROLES: Final = {
    "perception": "detector",
    "speech": "speech_to_text",
    "planner": "planner",
}
_RANKS: Final = {action: rank for rank, action in enumerate(LadderAction)}


def cross_faults(values: Table) -> Iterator[ProfileFault]:
    """Find every contradiction in values that are each in their range."""
    for check in _CHECKS:
        yield from check(values)


def _watchdogs(values: Table) -> Iterator[ProfileFault]:
    shortest_s = MIN_WATCHDOG_PERIODS / values["control_rate_hz"]
    for key in ("bus_watchdog_s", "can_heartbeat_s"):
        if values[key] < shortest_s:
            text = (
                f"expected at least {MIN_WATCHDOG_PERIODS} control periods ({shortest_s:g} s), "
                f"got {values[key]!r}"
            )
            yield ProfileFault(key=key, text=text)


def _perception(values: Table) -> Iterator[ProfileFault]:
    if values["perception_rate_hz"] > values["camera_rate_hz"]:
        text = (
            f"expected at most camera_rate_hz ({values['camera_rate_hz']:g} Hz), "
            f"got {values['perception_rate_hz']!r}"
        )
        yield ProfileFault(key="perception_rate_hz", text=text)


def _speech(values: Table) -> Iterator[ProfileFault]:
    speech = values["speech"]
    for key, least in (
        ("unfinished_silence_s", "end_silence_s"),
        ("longest_phrase_s", "shortest_phrase_s"),
    ):
        if speech[key] < speech[least]:
            text = f"expected at least {least} ({speech[least]:g} s), got {speech[key]!r}"
            yield ProfileFault(key=f"speech.{key}", text=text)


def _affinities(values: Table) -> Iterator[ProfileFault]:
    count = values["board"]["cpu_count"]
    for process, settings in values["processes"].items():
        beyond = [cpu for cpu in settings["affinity"] if cpu >= count]
        if beyond:
            text = f"expected CPUs of the board, 0 to {count - 1}, got {beyond}"
            yield ProfileFault(key=f"processes.{process}.affinity", text=text)


def _budget_sums(values: Table) -> Iterator[ProfileFault]:
    budgets = values["budgets"]
    for key, unit in (("memory_mb", "MB"), ("cpu_ratio", "cores")):
        total = budgets["total"][key]
        asked = sum(
            table[key] for name, table in budgets.items() if name not in ("total", _STAND_IN)
        )
        if asked > total:
            text = f"expected at least the {asked:g} {unit} of all processes, got {total!r}"
            yield ProfileFault(key=f"budgets.total.{key}", text=text)


def _board_limits(values: Table) -> Iterator[ProfileFault]:
    board, total = values["board"], values["budgets"]["total"]
    for key, has in (
        ("memory_mb", board["memory_mb"]),
        ("gpu_memory_mb", board["memory_mb"]),
        ("cpu_ratio", board["cpu_count"]),
    ):
        if total.get(key, 0) > has:
            text = f"expected at most the {has:g} that the board has, got {total[key]!r}"
            yield ProfileFault(key=f"budgets.total.{key}", text=text)


def _ladder_order(values: Table) -> Iterator[ProfileFault]:
    actions = [LadderAction(step["action"]) for step in values["ladder"]]
    for number in range(1, len(actions)):
        if _RANKS[actions[number]] < _RANKS[actions[number - 1]]:
            text = (
                f"expected the order {' -> '.join(LadderAction)}, "
                f"got {actions[number]} after {actions[number - 1]}"
            )
            yield ProfileFault(key=f"ladder[{number}].action", text=text)


def _ladder_steps(values: Table) -> Iterator[ProfileFault]:
    for number, step in enumerate(values["ladder"]):
        for key, text in _step_faults(step, tuple(values["processes"])):
            yield ProfileFault(key=f"ladder[{number}].{key}", text=text)


def _step_faults(step: Table, processes: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    process = step.get("process")
    allowed = ", ".join(name for name in processes if name not in _SPARED)
    if step["action"] == LadderAction.PROTECTIVE_STOP:
        if process is not None:
            yield "process", f"expected nothing, a stop concerns the robot, got {process!r}"
    elif process is None or process in _SPARED:
        yield "process", f"expected one of {allowed}, got {process or 'nothing'!r}"
    slows = step["action"] == LadderAction.SLOW
    if slows and step.get("ratio", 1.0) == 1.0:
        yield "ratio", f"expected a ratio below 1, got {step.get('ratio', 'nothing')}"
    if not slows and "ratio" in step:
        yield "ratio", f"expected nothing, only slow has a ratio, got {step['ratio']!r}"


def _smaller_models(values: Table) -> Iterator[ProfileFault]:
    """Find steps that would load the same model a second time, under want of memory."""
    wanted: Counter[str] = Counter()
    for number, step in enumerate(values["ladder"]):
        process = step.get("process")
        if step["action"] != LadderAction.SMALLER_MODEL or process in (None, *_SPARED):
            continue
        wanted[process] += 1
        role = _TIERED_ROLES.get(process)
        tiers = values["models"].get(role, {}).get("tiers", ())
        if len(set(tiers)) > wanted[process]:
            continue
        models = f"models.{role}.tiers has {', '.join(tiers) or 'nothing'}" if role else "no models"
        text = f"expected a smaller model of {process} to go to, got none: {models}"
        yield ProfileFault(key=f"ladder[{number}].action", text=text)


_CHECKS: Final[tuple[Callable[[Table], Iterator[ProfileFault]], ...]] = (
    _watchdogs,
    _perception,
    _speech,
    _affinities,
    _budget_sums,
    _board_limits,
    _ladder_order,
    _ladder_steps,
    _smaller_models,
)
