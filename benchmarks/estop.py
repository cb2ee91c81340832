"""Measure the emergency stop: from the request to the frame on the wire, and to standstill.

- `request_to_frame_ticks`: real processes, whose cores are kept busy by others. A listener on the
  CAN bus sees the first frame by which control no longer lets the first wheel drive operate: a base
  that drives is stopped quickly, one that rests loses its power. The time counts from just before
  the request is written to the ring that every source of a stop writes to; before each request the
  robot is armed anew. Where the machine permits, control has SCHED_FIFO, as on the robot
  (`realtime` tells).
- `standstill_s_<phase>`: in lock-step, so free of the machine's noise: from the request until no
  joint and no wheel moves faster than 0.02 rad/s, by physics.
"""

import os
import random
import statistics
import sys
import tempfile
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from benchmarks.command import parser, show
from drivers.clock import NS_PER_S
from platforms import load_profile
from sim_twin.campaigns.faulting.choreography import Phase
from sim_twin.campaigns.faulting.phases import PhaseStage
from sim_twin.harness.cores import REALTIME_PRIORITY, busy_cores, realtime
from sim_twin.harness.live_robot import live_robot
from sim_twin.harness.lockstep_stack import lockstep_robot
from sim_twin.harness.processes import ProcessStack
from sim_twin.harness.stop_witness import NoStop, StopWitness
from sim_twin.physics.truth import STANDSTILL_RAD_S, fastest_joint
from vla_deploy.ipc.stop_button import StopButton

_PERIOD_NS: Final = NS_PER_S / load_profile("desktop").control_rate_hz
_LONGEST_S: Final = 5.0
_LOOK_S: Final = 0.004


def measure(requests: int, seed: int) -> dict[str, Any]:
    """Return latencies under load and times to standstill.

    Raises:
        NoStop: a request had no effect.
    """
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:
        report = _latencies(Path(folder), requests, seed)
    return report | {f"standstill_s_{phase.value}": standstill_s(phase) for phase in Phase}


def _latencies(folder: Path, requests: int, seed: int) -> dict[str, Any]:
    with (
        realtime() as permitted,  # who measures must not wait for whom it keeps busy
        live_robot(folder, REALTIME_PRIORITY if permitted else 0) as robot,
        busy_cores(),
    ):
        ticks = _ask_again_and_again(robot, requests, random.Random(seed))
    if not ticks:
        raise NoStop(f"the robot stopped by itself before each of {requests} requests")
    ticks.sort()
    return {
        "requests": len(ticks),
        "stopped_before_request": requests - len(ticks),
        "realtime": permitted,
        "busy_processes": len(os.sched_getaffinity(0)),
        "request_to_frame_ticks_median": statistics.median(ticks),
        "request_to_frame_ticks_p99": ticks[min(len(ticks) - 1, round(0.99 * len(ticks)))],
        "request_to_frame_ticks_max": ticks[-1],
    }


def _ask_again_and_again(robot: ProcessStack, requests: int, draw: random.Random) -> list[float]:
    """Return, in control ticks, how long each request took to the wire.

    The busy machine itself may stop the robot before it is asked to: such a request is left out.
    """
    ticks = []
    with (
        closing(StopButton(robot.session.space, "bench", robot.clock)) as button,
        closing(StopWitness(robot.run_dir)) as witness,
    ):
        for _ in range(requests):
            robot.arm()
            robot.pause(draw.uniform(0.02, 0.1))
            if not witness.operates():
                continue
            asked_ns = robot.clock.now_ns()
            button.press()
            ticks.append((witness.stop_frame_ns() - asked_ns) / _PERIOD_NS)
            robot.await_change("armed")
    return ticks


def standstill_s(phase: Phase) -> float:
    """Return how long everything takes to rest after a request in a phase of the work."""
    with (
        tempfile.TemporaryDirectory(prefix="vla-") as folder,
        closing(lockstep_robot(Path(folder), takes_all=False)) as stack,
    ):
        stage = PhaseStage(stack)
        stage.begin(phase)
        began_s = stack.lockstep.now_s
        stack.operate("estop")
        while stack.lockstep.now_s - began_s < _LONGEST_S:
            stage.run_for(_LOOK_S)
            if fastest_joint(stack.lockstep.truth())[1] < STANDSTILL_RAD_S:
                return stack.lockstep.now_s - began_s
    raise NoStop(f"{phase.value}: not at rest {_LONGEST_S:g} s after the request")


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("estop", __doc__)
    arguments.add_argument("--requests", type=int, default=200)
    arguments.add_argument("--seed", type=int, default=0)
    options = arguments.parse_args(argv)
    show(measure(options.requests, options.seed), as_json=options.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
