"""Serve wheel drives with freely turning wheels on a CAN hub, to try a CAN tool against.

`python -m sim_twin.can --socket /tmp/can.sock --nodes 1 2`; another process then opens
`can.Bus(interface="vla_hub", channel="/tmp/can.sock")`. `--timed` gives frames the time of their
bits, `--protocol odrive` serves ODrive axes. With `--slcan /tmp/can.tty` tools that know no hub, or
no Python, find a serial adapter on the same bus: `slcand -o -c -s8 /tmp/can.tty`, or
`can.Bus(interface="slcan", channel="/tmp/can.tty", bitrate=1000000)`.
"""

import argparse
import select
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from drivers.errors import DeviceBusy
from sim_twin.can.bus.hub import CanHub
from sim_twin.can.bus.slcan import BITRATES, SlcanAdapter
from sim_twin.can.bus.wire import DEFAULT_BITRATE, CanWire
from sim_twin.can.drives import DRIVES
from sim_twin.can.emulated_drive import EmulatedDrive
from sim_twin.can.free_wheel import STEP_NS, FreeWheel
from sim_twin.ports.pty_line import PtyLine

_NODE_IDS: Final = {"cia402": (1, 126), "odrive": (0, 62)}
_BESIDE_THE_SOCKET: Final = Path()
_TERMINALS: Final = Path("/dev/pts")


def serve(
    hub: CanHub,
    line: PtyLine | None,
    wire: CanWire,
    wheels: Sequence[FreeWheel[EmulatedDrive]],
    clock: Clock,
) -> None:
    """Carry frames as they come and turn the wheels every 2 ms, until interrupted."""
    step_at_ns = clock.now_ns()
    terminals = [] if line is None else [line.fileno()]
    while True:
        due_ns = min(step_at_ns, wire.next_due_ns() or step_at_ns)
        wait_s = max(0.0, (due_ns - clock.now_ns()) / NS_PER_S)
        ready = select.select([*hub.filenos(), *terminals], [], [], wait_s)[0]
        wire.poll(clock.now_ns())
        if ready:
            hub.poll_once()
        if clock.now_ns() >= step_at_ns:
            for wheel in wheels:
                wheel.step(clock.now_ns(), STEP_NS / NS_PER_S)
            step_at_ns = max(step_at_ns + STEP_NS, clock.now_ns())
        if line is not None:
            line.poll_once()


def main() -> int:
    """Serve until interrupted; return 2 where the socket or the terminal cannot be had."""
    options = _parse()
    drive = DRIVES[options.protocol]
    wheels = [FreeWheel(drive(node_id)) for node_id in options.nodes]
    wire = CanWire([wheel.drive for wheel in wheels], bitrate=options.bitrate, timed=options.timed)
    with ExitStack() as stack, suppress(KeyboardInterrupt):
        try:
            hub = stack.enter_context(closing(CanHub(wire, options.socket)))
        except (DeviceBusy, OSError) as error:
            return _refuse(f"{options.socket}: {error}; choose another --socket")
        line, place = None, str(options.socket)
        if options.slcan is not None:
            try:
                line = stack.enter_context(closing(PtyLine(SlcanAdapter(wire), options.slcan)))
            except OSError as error:
                return _refuse(f"{options.slcan}: {error}; choose another --slcan")
            place += f", slcan at {line.link_path} ({line.link_path.readlink()})"
        sys.stdout.write(f"ready: {options.protocol} nodes {options.nodes} at {place}\n")
        sys.stdout.flush()
        serve(hub, line, wire, wheels, MonotonicClock())
    return 0


def _refuse(reason: str) -> int:
    sys.stderr.write(f"{reason}\n")
    return 2


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m sim_twin.can", description=__doc__)
    parser.add_argument(
        "--socket",
        type=Path,
        default=Path(tempfile.gettempdir()) / "can.sock",
        help="path of the hub's socket (default: %(default)s)",
    )
    parser.add_argument(
        "--slcan",
        type=Path,
        nargs="?",
        const=_BESIDE_THE_SOCKET,
        metavar="PATH",
        help="serve a serial adapter (slcan), too; PATH leads to its terminal "
        "(default: the socket's with .tty behind it)",
    )
    parser.add_argument("--nodes", type=int, nargs="+", default=[1, 2], help="node ids")
    parser.add_argument("--protocol", choices=DRIVES, default="cia402", help="default: cia402")
    parser.add_argument("--bitrate", type=int, default=DEFAULT_BITRATE, help="default: %(default)s")
    parser.add_argument("--timed", action="store_true", help="frames take the time of their bits")
    options = parser.parse_args()
    if options.slcan is not None:
        _place_slcan(parser, options)
    lowest, highest = _NODE_IDS[options.protocol]
    if len(set(options.nodes)) < len(options.nodes) or not all(
        lowest <= node_id <= highest for node_id in options.nodes
    ):
        parser.error(
            f"--nodes: expected different ids of {lowest}..{highest} for {options.protocol}, "
            f"got {options.nodes}"
        )
    return options


def _place_slcan(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    if options.slcan is _BESIDE_THE_SOCKET:
        options.slcan = options.socket.with_name(f"{options.socket.name}.tty")
    path: Path = options.slcan
    left_behind = path.is_symlink() and path.readlink().parent == _TERMINALS
    if not left_behind and (path.is_symlink() or path.exists()):
        parser.error(
            f"--slcan: {path} is there already and no link to a pseudo-terminal; choose another"
        )
    if options.bitrate not in BITRATES.values():
        parser.error(
            f"--slcan: expected a bit rate of slcan ({', '.join(map(str, BITRATES.values()))}), "
            f"got {options.bitrate}"
        )


if __name__ == "__main__":
    sys.exit(main())
