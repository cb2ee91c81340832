"""Measure where control's tick goes: the CPU time of each stage, by what the robot does in it.

The whole robot puts a cup into a box in lock-step, over lines in memory; only what runs within
control's step counts, and of that nothing that the emulated devices do to answer. Serial ports and
sockets cost a real robot system calls on top, which are not in these figures. The physics runs
between the ticks and empties the caches, as other processes do on a robot. Each stage is without
those inside it, and its timing costs about a microsecond a call.

`ticks_us` is in microseconds a tick, by kind: `idle` (armed, all at rest), `drive` (the base
moves), `arm` (joints move), `both`; and `all`. The `..._ratio` are shares of the period, over all
ticks. `guarded_cost_ratio` is the cost of a tick over that of the same tick without judging,
looking around and recording.
"""

import contextlib
import gc
import sys
import tempfile
from collections.abc import Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

from benchmarks.command import parser, rows, show
from benchmarks.spans import REST, Spans, Tally
from benchmarks.stopwatch import answering
from drivers.clock import NS_PER_S
from sim_twin.harness.lockstep_stack import LockstepStack, armed_lockstep
from vla_deploy.control.judging import safety_stage

_COMMAND: Final = "pick up the red cup and put it in the box"
_PARTS: Final[dict[str, tuple[str, ...]]] = {
    "read": ("_servos.read", "_judging.watch.refresh", "_inbox.listen", "_inbox.next_act"),
    "inputs": ("_judging.watch.inputs",),
    "contact": ("_judging._surroundings._contact.note", "_judging._surroundings._contact.update"),
    "clearance": (
        "_judging._surroundings._clearance.look_ahead",
        "_judging._surroundings._clearance.compare",
    ),
    "zones": ("_judging._surroundings._zones.look",),
    "surroundings": ("_judging._surroundings.refresh",),
    "record": ("_judging._record.judged", "_judging._record.sent"),
    "plan": ("_change_mode", "_take_commands", "_feel", "_ease_off", "_joints.move", "_move_base"),
    "limit": ("_joints._gate.limit",),
    "wheels": ("_wheels.cycle",),
    "write": ("_servos.write",),
    "tell": ("_tell",),
}
"""What is part of another's work comes before it; `surroundings` is keep-out, balance, the rest.
`wheels` is all that goes over CAN, both ways."""
_RECORDS: Final = attrgetter("_judging._record._ring._segment.memory")
_SHARED_MEMORY: Final = "/dev/shm"
_JUDGE: Final = "judge"
_DEVICES: Final = "devices"
_GUARDS: Final = (
    *("judge", "inputs", "contact", "clearance", "zones"),
    *("surroundings", "record"),
)
STAGES: Final = (*_PARTS, _JUDGE, REST)
_KINDS: Final = {
    (False, False): "idle",
    (True, False): "drive",
    (False, True): "arm",
    (True, True): "both",
}


def measure(seconds: float, seed: int) -> dict[str, Any]:
    """Return shares of the period, after control is armed and a command is given."""
    with (
        tempfile.TemporaryDirectory(prefix="vla-", dir=_SHARED_MEMORY) as folder,
        armed_lockstep(Path(folder), seed=seed) as stack,
    ):
        try:
            stack.give(text=_COMMAND)
            gc.collect()
            gc.freeze()  # as control's own process does
            bytes(_RECORDS(stack.control))  # locked memory causes no page faults later
            with contextlib.closing(Spans()) as spans:
                _instrument(spans, stack)
                stack.lockstep.run_for(seconds)
            return _report(spans, seconds, stack.control.period_s)
        finally:
            gc.unfreeze()


def _instrument(spans: Spans, stack: LockstepStack) -> None:
    control = stack.control
    at_rest = (attrgetter("_base.ramp"), attrgetter("_motions"))

    def kind() -> str:
        moves = tuple(not moved(control).at_rest for moved in at_rest)
        return _KINDS[moves[0], moves[1]]

    stepped = spans.step(control.step, kind)
    setattr(control, "step", stepped)  # noqa: B010 - a method of this one node
    for part, paths in _PARTS.items():
        for path in paths:
            owner, _, name = path.rpartition(".")
            spans.wrap(part, attrgetter(owner)(control) if owner else control, name)
    spans.wrap(_JUDGE, safety_stage, "evaluate")
    for owner, name in answering(stack.lockstep.twin):
        spans.wrap(_DEVICES, owner, name)


def _report(spans: Spans, seconds: float, period_s: float) -> dict[str, Any]:
    period_ns = period_s * NS_PER_S
    shares = {stage: spans.cpu_ns[stage] / spans.steps / period_ns for stage in STAGES}
    total = sum(shares.values())
    every = Tally(spans.steps, spans.cpu_ns)
    return {
        "simulated_s": seconds,
        "ticks": spans.steps,
        "period_s": period_s,
        **{f"{stage}_ratio": share for stage, share in shares.items()},
        "total_ratio": total,
        "guarded_cost_ratio": total / (total - sum(shares[stage] for stage in _GUARDS)),
        "ticks_us": {
            **{kind: _column(spans.kinds[kind]) for kind in _KINDS.values() if kind in spans.kinds},
            "all": _column(every),
        },
    }


def _column(tally: Tally) -> dict[str, float]:
    """Return the number of ticks, and what each stage and all of them took of one."""
    stages = {stage: tally.cpu_ns[stage] / tally.steps / 1e3 for stage in STAGES}
    return {"ticks": tally.steps, **stages, "total": sum(stages.values())}


def _text(report: dict[str, Any]) -> str:
    """Return the figures, and the stages as a table with a column per kind of tick."""
    columns = report["ticks_us"]
    head = f"{'us a tick':14}" + "".join(f"{kind:>9}" for kind in columns)
    lines = [
        f"{stage:14}" + "".join(f"{column[stage]:9.4g}" for column in columns.values())
        for stage in ("ticks", *STAGES, "total")
    ]
    figures = rows({name: value for name, value in report.items() if name != "ticks_us"})
    return "\n".join((figures, "", head, *lines))


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("control", __doc__)
    arguments.add_argument("--seconds", type=float, default=20.0, help="of simulated time")
    arguments.add_argument("--seed", type=int, default=0)
    options = arguments.parse_args(argv)
    show(measure(options.seconds, options.seed), as_json=options.json, text=_text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
