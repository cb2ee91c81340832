"""Measure where control's tick goes: the CPU time of each part as a share of the period.

The whole robot puts a cup into a box in lock-step, over lines in memory; only what runs within
control's step counts, and of that nothing that the emulated devices do to answer. Serial ports and
sockets cost a real robot system calls on top, which are not in these figures.
`guarded_cost_ratio` is the cost of a tick over that of the same tick without judging, looking
around and recording.
"""

import contextlib
import gc
import sys
import tempfile
from collections.abc import Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

from benchmarks.command import parser, show
from benchmarks.spans import REST, Spans
from benchmarks.stopwatch import answering
from drivers.clock import NS_PER_S
from sim_twin.stack import LockstepStack
from vla_deploy.control import judging

_COMMAND: Final = "pick up the red cup and put it in the box"
_PARTS: Final[dict[str, tuple[str, ...]]] = {
    "read": ("_servos.read", "_judging.watch.refresh", "_desk.listen", "_desk.next_act"),
    "inputs": ("_judging.watch.inputs",),
    "surroundings": ("_judging._surroundings.refresh",),
    "record": ("_judging._record.judged", "_judging._record.sent"),
    "plan_and_limit": ("_change_mode", "_take_commands", "_joints.move", "_move_base"),
    "write": ("_servos.write", "_wheels.cycle"),
    "tell": ("_tell",),
}
_JUDGE: Final = "judge"
_DEVICES: Final = "devices"
_GUARDS: Final = (_JUDGE, "inputs", "surroundings", "record")


def measure(seconds: float, seed: int) -> dict[str, Any]:
    """Return shares of the period, after control is armed and a command is given."""
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:
        stack = LockstepStack(Path(folder), seed=seed)
        try:
            stack.arm()
            stack.give(text=_COMMAND)
            gc.collect()
            gc.freeze()  # as control's own process does
            with contextlib.closing(Spans()) as spans:
                _instrument(spans, stack)
                stack.lockstep.run_for(seconds)
            return _report(spans, seconds, stack.control.period_s)
        finally:
            gc.unfreeze()
            stack.close()


def _instrument(spans: Spans, stack: LockstepStack) -> None:
    control = stack.control
    setattr(control, "step", spans.step(control.step))  # noqa: B010 - a method of this one node
    for part, paths in _PARTS.items():
        for path in paths:
            owner, _, name = path.rpartition(".")
            spans.wrap(part, attrgetter(owner)(control) if owner else control, name)
    spans.wrap(_JUDGE, judging, "evaluate")
    for owner, name in answering(stack.lockstep.twin):
        spans.wrap(_DEVICES, owner, name)


def _report(spans: Spans, seconds: float, period_s: float) -> dict[str, Any]:
    period_ns = period_s * NS_PER_S
    parts = (*_PARTS, _JUDGE, REST)
    shares = {part: spans.cpu_ns[part] / spans.steps / period_ns for part in parts}
    total = sum(shares.values())
    return {
        "simulated_s": seconds,
        "ticks": spans.steps,
        "period_s": period_s,
        **{f"{part}_ratio": share for part, share in shares.items()},
        "total_ratio": total,
        "guarded_cost_ratio": total / (total - sum(shares[part] for part in _GUARDS)),
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("control", __doc__)
    arguments.add_argument("--seconds", type=float, default=20.0, help="of simulated time")
    arguments.add_argument("--seed", type=int, default=0)
    options = arguments.parse_args(argv)
    show(measure(options.seconds, options.seed), as_json=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
