"""Time the stop of real processes from the request to the frame on the wire, by the wall clock."""

import random
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, nullcontext
from itertools import groupby
from pathlib import Path
from typing import Final

from sim_twin.campaigns.report import CampaignCase
from sim_twin.campaigns.stopping.cells import CpuLoad, WallCell, WallSource
from sim_twin.campaigns.stopping.stop_trials import spread
from sim_twin.harness.cores import REALTIME_PRIORITY, busy_cores, realtime
from sim_twin.harness.live_robot import live_robot
from sim_twin.harness.processes import ProcessStack
from sim_twin.harness.robot import RobotFailed
from sim_twin.harness.stop_presser import StopPresser, send_press
from sim_twin.harness.stop_witness import NoStop
from vla_deploy.ipc.stop_button import StopButton

_MS_PER_S: Final = 1e3
_ANSWER_S: Final = 20.0
"""A command is a process first, which takes long to begin on a busy computer."""


def play_all(cells: Sequence[WallCell], seed: int, count: int) -> Iterator[CampaignCase]:
    """Play cells of the wall clock, those of one load on one robot."""
    for load, mine in groupby(cells, key=lambda cell: cell.load):
        yield from _play_load(load, list(mine), seed, count)


def _play_load(
    load: CpuLoad, cells: Sequence[WallCell], seed: int, count: int
) -> Iterator[CampaignCase]:
    played = 0
    try:
        with (
            tempfile.TemporaryDirectory(prefix="vla-") as folder,
            realtime() as permitted,  # who measures must not wait for whom it keeps busy
            live_robot(Path(folder), REALTIME_PRIORITY if permitted else 0) as robot,
            closing(StopPresser(robot, random.Random(seed))) as presser,
            busy_cores() if load is CpuLoad.BUSY else nullcontext(),
        ):
            for cell in cells:
                yield _play(cell, presser, count, is_realtime=permitted)
                played += 1
    except RobotFailed as error:
        for cell in cells[played:]:
            yield CampaignCase(name=cell.name, skipped=f"the robot did not come up: {error}")


def _play(cell: WallCell, presser: StopPresser, count: int, *, is_realtime: bool) -> CampaignCase:
    times_ms: list[float] = []
    failures: tuple[str, ...] = ()
    try:
        with closing(StopButton(presser.robot.session.space, "bench", presser.robot.clock)) as ring:
            press, after = _PRESSES[cell.source](presser, ring)
            for _ in range(count):
                time_ms = presser.timed(press, _ANSWER_S)
                after()
                times_ms += [] if time_ms is None else [time_ms]
    except NoStop as error:
        failures = (str(error),)
    if not times_ms and not failures:
        why = "the busy computer stopped the robot before each request"
        return CampaignCase(name=cell.name, skipped=why)
    figures = {
        "n": len(times_ms),
        "left_out": count - len(times_ms) if not failures else None,
        "realtime": is_realtime,
        **spread("to_wire_s", [time_ms / _MS_PER_S for time_ms in times_ms]),
    }
    return CampaignCase(name=cell.name, failures=failures, figures=figures)


Press = Callable[[ExitStack], object]
After = Callable[[], object]


def _by_ring(_presser: StopPresser, ring: StopButton) -> tuple[Press, After]:
    return lambda _opened: ring.press(), _nothing


def _by_door(door: str) -> Callable[[StopPresser, StopButton], tuple[Press, After]]:
    def prepared(presser: StopPresser, _ring: StopButton) -> tuple[Press, After]:
        address = presser.address(door)
        return lambda opened: send_press(opened, door, address), _nothing

    return prepared


def _by_command(presser: StopPresser, _ring: StopButton) -> tuple[Press, After]:
    """Press by `vla-deploy estop`: from before its process begins."""
    return lambda _opened: presser.robot.begin("estop"), _nothing


def _by_button(presser: StopPresser, _ring: StopButton) -> tuple[Press, After]:
    """Press the twin's HID button: the way to the twin's process counts, too."""
    robot: ProcessStack = presser.robot
    return (
        lambda _opened: robot.faults.inject("estop", None, "wrong"),
        lambda: robot.faults.clear_all(),
    )


def _nothing() -> None:
    """Take nothing back."""


_PRESSES: Final[Mapping[WallSource, Callable[[StopPresser, StopButton], tuple[Press, After]]]] = {
    WallSource.REQUEST: _by_ring,
    WallSource.PAGE: _by_door("page"),
    WallSource.DOOR: _by_door("door"),
    WallSource.CLI: _by_command,
    WallSource.BUTTON: _by_button,
}
