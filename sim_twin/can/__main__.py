"""Serve wheel drives with freely turning wheels on a CAN hub, to try a CAN tool against.

`python -m sim_twin.can --socket /tmp/can.sock --nodes 1 2`; another process then opens
`can.Bus(interface="vla_hub", channel="/tmp/can.sock")`. `--timed` gives frames the time of their
bits, `--protocol odrive` serves ODrive axes.
"""

import argparse
import select
import sys
from collections.abc import Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from drivers.errors import DeviceBusy
from sim_twin.can.bus.hub import CanHub
from sim_twin.can.bus.wire import DEFAULT_BITRATE, CanWire
from sim_twin.can.drives import DRIVES
from sim_twin.can.emulated_drive import EmulatedDrive
from sim_twin.can.free_wheel import STEP_NS, FreeWheel

_NODE_IDS: Final = {"cia402": (1, 126), "odrive": (0, 62)}


def serve(
    hub: CanHub, wire: CanWire, wheels: Sequence[FreeWheel[EmulatedDrive]], clock: Clock
) -> None:
    """Carry frames as they come and turn the wheels every 2 ms, until interrupted."""
    step_at_ns = clock.now_ns()
    while True:
        due_ns = min(step_at_ns, wire.next_due_ns() or step_at_ns)
        wait_s = max(0.0, (due_ns - clock.now_ns()) / NS_PER_S)
        ready = select.select(hub.filenos(), [], [], wait_s)[0]
        wire.poll(clock.now_ns())
        if ready:
            hub.poll_once()
        if clock.now_ns() >= step_at_ns:
            for wheel in wheels:
                wheel.step(clock.now_ns(), STEP_NS / NS_PER_S)
            step_at_ns = max(step_at_ns + STEP_NS, clock.now_ns())


def main() -> int:
    """Serve until interrupted; return 2 where the socket cannot be had."""
    options = _parse()
    drive = DRIVES[options.protocol]
    wheels = [FreeWheel(drive(node_id)) for node_id in options.nodes]
    wire = CanWire([wheel.drive for wheel in wheels], bitrate=options.bitrate, timed=options.timed)
    try:
        hub = CanHub(wire, options.socket)
    except (DeviceBusy, OSError) as error:
        sys.stderr.write(f"{options.socket}: {error}; choose another --socket\n")
        return 2
    sys.stdout.write(f"ready: {options.protocol} nodes {options.nodes} at {options.socket}\n")
    sys.stdout.flush()
    with closing(hub), suppress(KeyboardInterrupt):
        serve(hub, wire, wheels, MonotonicClock())
    return 0


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m sim_twin.can", description=__doc__)
    parser.add_argument("--socket", type=Path, required=True, help="path of the hub's socket")
    parser.add_argument("--nodes", type=int, nargs="+", default=[1, 2], help="node ids")
    parser.add_argument("--protocol", choices=DRIVES, default="cia402", help="default: cia402")
    parser.add_argument("--bitrate", type=int, default=DEFAULT_BITRATE, help="default: %(default)s")
    parser.add_argument("--timed", action="store_true", help="frames take the time of their bits")
    options = parser.parse_args()
    lowest, highest = _NODE_IDS[options.protocol]
    if len(set(options.nodes)) < len(options.nodes) or not all(
        lowest <= node_id <= highest for node_id in options.nodes
    ):
        parser.error(
            f"--nodes: expected different ids of {lowest}..{highest} for {options.protocol}, "
            f"got {options.nodes}"
        )
    return options


if __name__ == "__main__":
    sys.exit(main())
