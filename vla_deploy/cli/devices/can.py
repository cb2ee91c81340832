"""`vla-deploy can scan | monitor`: find CAN nodes and print the traffic; nothing is changed."""

import argparse
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

import can

from drivers.can.interface import SERIAL_PREFIX, open_can_bus
from drivers.can.link import CanLink
from drivers.can.scan import BusScan, FoundAxis, FoundNode, ScanReport
from drivers.can.words import Words, describe_canopen, describe_odrive
from drivers.clock import NS_PER_S, MonotonicClock
from drivers.errors import ProtocolError
from drivers.stepping import wait_for
from vla_deploy.cli.commands import (
    add_command,
    add_top_command,
    emit,
    number_above_zero,
    whole_number,
)
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.robots import load_robot
from vla_deploy.robots.devices import CanBus

INTERFACES = ("socketcan", "slcan", "vla_hub")
BITRATES = (125_000, 250_000, 500_000, 800_000, 1_000_000)
POLL_NS = 1_000_000
DESCRIBERS: dict[str, Callable[[can.Message], Words]] = {
    "canopen": describe_canopen,
    "odrive": describe_odrive,
}
_PROTOCOL_OF_ROBOT = {"cia402": "canopen", "odrive": "odrive"}


def register(commands: Any) -> None:
    """Add the group of commands."""
    group = add_top_command(
        commands,
        "can",
        "  vla-deploy can scan --robot butler\n"
        "  vla-deploy can monitor --interface slcan --channel /dev/ttyACM0 --bitrate 500000\n",
    ).add_subparsers(dest="can_command", required=True, metavar="CAN_COMMAND")
    scan = add_command(
        group,
        "scan",
        "find CANopen nodes and ODrive axes",
        "  vla-deploy can scan --robot butler\n"
        "  vla-deploy can scan --interface socketcan --channel can0 --protocol odrive --json\n",
        run_scan,
        json_help="print JSON",
    )
    _add_bus_arguments(scan)
    monitor = add_command(
        group,
        "monitor",
        "print the traffic in words",
        "  vla-deploy can monitor --robot butler --seconds 5\n"
        "  vla-deploy can monitor --robot butler --node 2\n"
        "  vla-deploy can monitor --robot butler --id 0x181 --id 0x201\n"
        "  vla-deploy can monitor --interface vla_hub --channel ./can --count 20 --json\n",
        run_monitor,
        json_help="print JSON",
    )
    _add_bus_arguments(monitor)
    monitor.add_argument("--count", type=whole_number(), help="stop after so many frames")
    monitor.add_argument(
        "--seconds", type=number_above_zero("seconds"), help="stop after this time"
    )
    monitor.add_argument(
        "--id", type=_identifier, action="append", metavar="ID", help="only this id (repeat it)"
    )
    monitor.add_argument(
        "--node", type=_identifier, action="append", metavar="N", help="only this node (repeat it)"
    )


def _identifier(text: str) -> int:
    try:
        number = int(text, 0)
    except ValueError:
        number = -1
    if not 0 <= number < 1 << 29:
        raise argparse.ArgumentTypeError(f"expected a number such as 385 or 0x181, got {text!r}")
    return number


def _add_bus_arguments(command: argparse.ArgumentParser) -> None:
    which = command.add_mutually_exclusive_group(required=True)
    which.add_argument("--robot", metavar="NAME", help="the bus of this robot's wheel drives")
    which.add_argument("--interface", choices=INTERFACES, help="kind of interface")
    command.add_argument("--channel", help="can0, /dev/ttyACM0, or the path of a twin's hub")
    command.add_argument("--bitrate", type=int, choices=BITRATES, metavar="N", help="bit/s")
    command.add_argument(
        "--protocol",
        choices=tuple(DESCRIBERS),
        help="(default: the robot's; else a scan looks for both, the monitor expects canopen)",
    )


def _wiring(arguments: argparse.Namespace) -> tuple[str, int, str | None]:
    """Return channel, bit rate and protocol.

    Raises:
        UsageError: an interface is given without its channel.
    """
    if arguments.robot is not None:
        bus: CanBus = load_robot(arguments.robot).can_bus
        protocol = arguments.protocol or _PROTOCOL_OF_ROBOT[bus.protocol]
        return arguments.channel or bus.path, arguments.bitrate or bus.bitrate, protocol
    channel = arguments.channel
    if channel is None:
        raise UsageError(f"--interface {arguments.interface} needs --channel, such as can0")
    if arguments.interface == "slcan":
        channel = SERIAL_PREFIX + channel
    elif arguments.interface == "vla_hub" and "/" not in channel:
        channel = f"./{channel}"
    return channel, arguments.bitrate or BITRATES[-1], arguments.protocol


@contextmanager
def _opened(channel: str, bitrate: int) -> Iterator[can.BusABC]:
    bus = open_can_bus(channel, bitrate)
    try:
        yield bus
    finally:
        bus.shutdown()


def run_scan(arguments: argparse.Namespace) -> int:
    """Print the nodes on the bus.

    Raises:
        CommandFailed: there is none.
    """
    channel, bitrate, protocol = _wiring(arguments)
    clock = MonotonicClock()
    with _opened(channel, bitrate) as bus:
        link = CanLink(bus, clock)
        scan = BusScan(link, clock, canopen=protocol != "odrive", odrive=protocol != "canopen")
        wait_for(scan.steps(), clock)
        trouble = link.trouble
    report = scan.report
    emit(arguments, _scan_document(channel, report), "\n".join(_scan_lines(report)))
    if not report.nodes and not report.axes:
        reason = trouble or "check power, bit rate, wiring and termination"
        raise CommandFailed(f"{channel}: nobody answers at {bitrate} bit/s; {reason}")
    return 0


def _scan_document(channel: str, report: ScanReport) -> dict[str, Any]:
    return {
        "channel": channel,
        "canopen": [
            {**asdict(node), "profile": node.profile} for _, node in sorted(report.nodes.items())
        ],
        "odrive": [asdict(axis) for _, axis in sorted(report.axes.items())],
        "silent_nodes_were_asked": report.probed,
    }


def _scan_lines(report: ScanReport) -> Iterator[str]:
    for _, node in sorted(report.nodes.items()):
        yield _node_line(node)
    for _, axis in sorted(report.axes.items()):
        yield _axis_line(axis)
    if report.axes and not report.probed:
        yield "silent CANopen nodes were not asked: to ODrive axes that could be a command"


def _node_line(node: FoundNode) -> str:
    if node.device_type is None:
        return f"CANopen node {node.node_id:3}: {node.state}, does not answer by SDO"
    identity = ", ".join(
        f"{name} {'unknown' if value is None else f'0x{value:08X}'}"
        for name, value in (
            ("vendor", node.vendor),
            ("product", node.product),
            ("revision", node.revision),
            ("serial", node.serial),
        )
    )
    return f"CANopen node {node.node_id:3}: profile {node.profile}, {identity}, {node.state}"


def _axis_line(axis: FoundAxis) -> str:
    return (
        f"ODrive axis {axis.node_id:4}: firmware {axis.firmware}, {axis.state}, "
        f"errors {axis.errors}"
    )


def run_monitor(arguments: argparse.Namespace) -> int:
    """Print frames until the count or the time is reached, or Ctrl-C."""
    channel, bitrate, protocol = _wiring(arguments)
    describe = DESCRIBERS[protocol or "canopen"]
    clock = MonotonicClock()
    start_ns = clock.now_ns()
    end_ns = None if arguments.seconds is None else start_ns + round(arguments.seconds * NS_PER_S)
    seen = 0
    with _opened(channel, bitrate) as bus:
        while (arguments.count is None or seen < arguments.count) and (
            end_ns is None or clock.now_ns() < end_ns
        ):
            frame = _next_frame(bus)
            if frame is None:
                clock.sleep_until(clock.now_ns() + POLL_NS)
                continue
            words = describe(frame)
            if not _is_wanted(arguments, frame, words):
                continue
            seen += 1
            time_s = (clock.now_ns() - start_ns) / NS_PER_S
            describe_frame = _frame_json if arguments.json else _frame_line
            print(describe_frame(time_s, frame, words), flush=True)
    return 0


def _is_wanted(arguments: argparse.Namespace, frame: can.Message, words: Words) -> bool:
    if arguments.id is None and arguments.node is None:
        return True
    return frame.arbitration_id in (arguments.id or ()) or words.node in (arguments.node or ())


def _next_frame(bus: can.BusABC) -> can.Message | None:
    """Return the next frame, None where there is none or it is damaged."""
    try:
        return bus.recv(0.0)
    except ProtocolError:
        return None
    except can.CanError as error:
        raise CommandFailed(f"{bus.channel_info}: {error}") from error


def _frame_line(time_s: float, frame: can.Message, words: Words) -> str:
    node = "" if words.node is None else f" {words.node}"
    data = bytes(frame.data).hex(" ")
    return (
        f"{time_s:10.4f}  0x{frame.arbitration_id:03X}  {data:24}{words.kind}{node}  {words.text}"
    )


def _frame_json(time_s: float, frame: can.Message, words: Words) -> str:
    return json.dumps(
        {
            "time_s": round(time_s, 6),
            "id": frame.arbitration_id,
            "data": bytes(frame.data).hex(),
            "remote": frame.is_remote_frame,
            "kind": words.kind,
            "node": words.node,
            "text": words.text,
        }
    )
