"""Measure what the flight recorder costs: in each control tick, on its own core, per flight.

The whole robot puts a cup into a box in lock-step; times are CPU times of the thread. The physics
runs between the ticks and empties the caches, so `tick_ratio` is an upper bound; the same ticks
recorded once more one after another, `tick_ratio_in_a_row`, are a lower one. A flight is written
in small parts between looks: `write_core_ratio` is the share of a core while that lasts.
"""

import contextlib
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import fields
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.command import parser, show
from benchmarks.spans import REST, Spans
from drivers.clock import NS_PER_S
from sim_twin.harness.lockstep_stack import LockstepStack, armed_lockstep
from vla_deploy.control.judging.tick_recorder import TickRecorder
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.safety import SafetyInputs
from vla_deploy.telemetry.folder import FlightFolder
from vla_deploy.telemetry.node import RecorderNode

_COMMAND: Final = "pick up the red cup and put it in the box"
_WALL_NS: Final = 1_800_000_000_000_000_000
_RECORD: Final = "record"
_WRITE_TIMEOUT_S: Final = 60.0

Call = tuple[Callable[..., None], tuple[Any, ...]]


def measure(seconds: float, seed: int) -> dict[str, Any]:
    """Return shares and times, after control is armed and a command is given."""
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:
        run_dir = Path(folder) / "run"
        run_dir.mkdir()
        with armed_lockstep(run_dir, seed=seed) as stack:
            ticks, calls = _ticks(stack, seconds / 2, Path(folder) / "again")
            return {**ticks, "ticks": calls, **_recorder(stack, seconds / 2, Path(folder))}


def _ticks(stack: LockstepStack, seconds: float, again: Path) -> tuple[dict[str, float], int]:
    control, calls = stack.control, list[Call]()
    tick_record = attrgetter("_judging._record")(control)
    period_ns = control.period_s * NS_PER_S
    with contextlib.closing(Spans()) as spans:
        setattr(control, "step", spans.step(control.step))  # noqa: B010 - of this one node
        for name in ("judged", "sent"):
            spans.wrap(_RECORD, tick_record, name)
            _keep(calls, tick_record, name)
        stack.give(text=_COMMAND)
        stack.lockstep.run_for(seconds)
    in_turns_ns = spans.cpu_ns[_RECORD] / spans.steps
    in_a_row_ns = _in_a_row_ns(calls, again, stack) / spans.steps
    ratios = {"tick_ratio": in_turns_ns, "tick_ratio_in_a_row": in_a_row_ns}
    return {name: cost_ns / period_ns for name, cost_ns in ratios.items()}, spans.steps


def _keep(calls: list[Call], owner: Any, name: str) -> None:
    """Remember what is handed in, outside of what is timed."""
    timed = getattr(owner, name)

    def kept(*arguments: Any) -> None:
        calls.append((getattr(TickRecorder, name), tuple(map(_still, arguments))))
        timed(*arguments)

    setattr(owner, name, kept)


def _still(value: Any) -> Any:
    """Return what the next tick does not alter: all else is kept, for the recorder knows it."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, SafetyInputs):
        held = {field.name: getattr(value, field.name) for field in fields(value)}
        return SafetyInputs(**{name: _still(part) for name, part in held.items()})
    return value


def _in_a_row_ns(calls: Sequence[Call], directory: Path, stack: LockstepStack) -> int:
    recorder = TickRecorder(SharedSpace(directory, stack.lockstep.clock))
    started_ns = time.thread_time_ns()
    for method, arguments in calls:
        method(recorder, *arguments)
    spent_ns = time.thread_time_ns() - started_ns
    recorder.close()
    return spent_ns


def _recorder(stack: LockstepStack, seconds: float, folder: Path) -> dict[str, float]:
    """Let the recorder look for some time, then save what it remembers."""
    step, flights = stack.lockstep, FlightFolder(folder / "flights")
    node = RecorderNode(step.context, flights, lambda: _WALL_NS + step.clock.now_ns())
    spans = Spans()
    setattr(node, "step", spans.step(node.step))  # noqa: B010 - of this one node
    step.add(node)
    step.run_for(seconds)
    looks, look_ns = spans.steps, spans.cpu_ns[REST]
    stack.space.ring_writer(topics.FLIGHT_REQUEST).publish({"source": "bench", "reason": ""})
    if not step.run_until(lambda: bool(flights.files()), _WRITE_TIMEOUT_S):
        raise SystemExit("no flight was written")
    steps, step_ns = spans.steps - looks, spans.cpu_ns[REST] - look_ns
    period_ns = node.period_s * NS_PER_S
    return {
        "look_core_ratio": look_ns / looks / period_ns,
        "write_core_ratio": step_ns / steps / period_ns,
        "write_cpu_s": (step_ns - look_ns / looks * steps) / NS_PER_S,
        "flight_bytes": flights.find("latest").stat().st_size,
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("recorder", __doc__)
    arguments.add_argument("--seconds", type=float, default=20.0, help="of simulated time")
    arguments.add_argument("--seed", type=int, default=0)
    options = arguments.parse_args(argv)
    show(measure(options.seconds, options.seed), as_json=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
