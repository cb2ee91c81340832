"""Measure the stop of the dashboard's page: from the press to the frame on the wire.

Real processes on a twin, with `clients` pages connected to the dashboard's live data and every core
kept busy by others. A press is what the page sends: a request to each door, over connections of
their own. It counts from before they are opened, to the first frame by which control no longer
lets the first wheel drive operate. `both` presses both doors, as the page does, `page` and `door`
one alone; `blocked` and `killed` press both while the dashboard's process is frozen for up to 10 s,
which blocks its event loop and all else of it, and after it was killed. A browser's own time to
notice a finger is not in it. `loaded` presses the dashboard's door alone under 200 slow
connections, 30 threads of costly reads and 40 of TLS handshakes.
"""

import random
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, Final

from benchmarks.load_process import load_process
from drivers.clock import NS_PER_S, Clock
from sim_twin.harness.cores import REALTIME_PRIORITY, busy_cores, realtime
from sim_twin.harness.live_robot import live_robot
from sim_twin.harness.processes import ProcessStack
from sim_twin.harness.stop_presser import StopPresser
from sim_twin.harness.stop_witness import NoStop

CLIENTS: Final = 20
BOTH: Final = ("page", "door")
BLOCKED_S: Final = 10.0
KILLS: Final = 3
_TOPICS: Final = "control_status,process_table,joint_state,pose,scan,scene"
_SETTLED_S: Final = 8.0  # of a frozen dashboard's 10 s, so that a press never meets the thaw
_LOADED_S: Final = 3.0  # until all of a load goes on
_START_S: Final = 90.0


def measure(requests: int = 100, seed: int = 0) -> dict[str, Any]:
    """Return the times of each way in ms.

    Raises:
        NoStop: a press had no effect, or there was none.
    """
    with (
        tempfile.TemporaryDirectory(prefix="vla-") as folder,
        realtime() as permitted,  # who measures must not wait for whom it keeps busy
        live_robot(Path(folder), REALTIME_PRIORITY if permitted else 0) as robot,
        closing(StopPresser(robot, random.Random(seed))) as presser,
        busy_cores(),
    ):
        with _pages(presser.address("page"), robot.base):
            with _load(presser.address("page"), robot.base) as came:
                robot.pause(_LOADED_S)
                loaded = presser.presses(requests // 2, ("page",))
            figures = {
                "loaded": loaded,
                "both": presser.presses(requests, BOTH),
                "page": presser.presses(requests // 4, ("page",)),
                "door": presser.presses(requests // 4, ("door",)),
                "blocked": _while_frozen(presser, requests // 4),
            }
        figures["killed"] = _after_kills(presser)
    report: dict[str, Any] = {"clients": CLIENTS, "realtime": permitted, "load": came}
    for way, times_ms in figures.items():
        report |= _figures(way, times_ms)
    return report


def _figures(way: str, times_ms: list[float]) -> dict[str, Any]:
    if not times_ms:
        raise NoStop(f"{way}: the robot stopped by itself before each press")
    ordered = sorted(times_ms)
    return {
        f"{way}_presses": len(ordered),
        f"{way}_to_frame_ms_p50": ordered[len(ordered) // 2],
        f"{way}_to_frame_ms_p99": ordered[min(len(ordered) - 1, round(0.99 * len(ordered)))],
        f"{way}_to_frame_ms_max": ordered[-1],
    }


def _while_frozen(presser: StopPresser, count: int) -> list[float]:
    """Press while the dashboard is frozen, in turns with spans in which it goes on."""
    times_ms: list[float] = []
    clock = presser.robot.clock
    while len(times_ms) < count:
        with _frozen(presser.robot):
            found = presser.presses(count - len(times_ms), BOTH, _for(_SETTLED_S, clock))
            presser.robot.pause(max(0.0, BLOCKED_S - _SETTLED_S))
        if not found:
            break
        times_ms += found
        presser.robot.pause(1.0)
    return times_ms


def _for(seconds: float, clock: Clock) -> Callable[[], bool]:
    end_ns = clock.now_ns() + round(seconds * NS_PER_S)
    return lambda: clock.now_ns() < end_ns


@contextmanager
def _frozen(robot: ProcessStack) -> Iterator[None]:
    _await_dashboard(robot)
    robot.freeze("dashboard")
    try:
        yield
    finally:
        robot.thaw("dashboard")


def _after_kills(presser: StopPresser) -> list[float]:
    """Press right after each of a few kills, before the supervisor has the dashboard back."""
    times_ms: list[float] = []
    for _ in range(KILLS):
        _await_dashboard(presser.robot)
        presser.robot.kill("dashboard")
        times_ms += presser.presses(1, BOTH)
        presser.robot.pause(BLOCKED_S)
    return times_ms


def _await_dashboard(robot: ProcessStack) -> None:
    """Return once the dashboard runs."""
    if not robot.wait_until(lambda: robot.row("dashboard")["state"] == "ready", _START_S):
        raise NoStop("there is no dashboard to be without; see `vla-deploy status`")


@contextmanager
def _load(address: tuple[str, int], base: Path) -> Iterator[dict[str, int]]:
    """Load the dashboard; how much came through is told at the end."""
    came: dict[str, int] = {}
    words = [address[0], str(address[1]), str(base)]
    failure = NoStop("the dashboard could not be loaded")
    with load_process("benchmarks.dashboard_load", words, came, failure):
        yield came


@contextmanager
def _pages(address: tuple[str, int], base: Path) -> Iterator[None]:
    """Keep pages connected, which take what the dashboard tells."""
    words = [address[0], str(address[1]), str(CLIENTS), "0", _TOPICS, str(base)]
    failure = NoStop("the pages could not connect")
    with load_process("benchmarks.live_clients", words, {}, failure):
        yield
