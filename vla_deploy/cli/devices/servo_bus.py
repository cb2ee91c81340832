"""Open a servo bus for a command: by port and speed, or as a robot file declares it."""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from drivers.base import ByteTransport
from drivers.clock import Clock, MonotonicClock
from drivers.errors import DeviceMissing
from drivers.recording.recorder import RecordingTransport, WireRecorder
from drivers.serial_port import SerialPort
from drivers.servo.family import FAMILIES, ServoFamily, family_of, servo_family
from drivers.servo.tools.bench import ServoBench
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.terminal import CLEAR_LINE, control
from vla_deploy.robots import RobotDescription, load_robot

_NO_TTY_SPEEDS = (4_500_000, 250_000, 128_000)
SPEEDS = tuple(
    sorted(
        {rate for name in FAMILIES for rate in servo_family(name).baud_rates} - set(_NO_TTY_SPEEDS)
    )
)
"""The speeds of servos that a tty offers too."""
DEFAULT_BAUD = 1_000_000
SERIAL_NAMES = ("ttyUSB*", "ttyACM*", "ttyTHS*")


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoBusPort:
    """Describe the port of a servo bus, and the robot file that declares its servos."""

    port: Path
    baud: int
    family: ServoFamily = field(default_factory=lambda: servo_family(FAMILIES[0]))
    baud_given: bool = True
    robot: RobotDescription | None = None
    record: Path | None = None
    clock: Clock = field(default_factory=MonotonicClock)

    @property
    def is_pseudo_terminal(self) -> bool:
        """Return whether the port is a pseudo-terminal, such as the twin's, which has no speed."""
        return str(self.port.resolve()).startswith("/dev/pts/")

    @contextmanager
    def open(self, baud: int | None = None) -> Iterator[ServoBench]:
        """Open the bus for a `with` block.

        Raises:
            DeviceMissing: the port is not there.
            DeviceBusy: another process holds it.
        """
        baud = baud or self.baud
        try:
            transport: ByteTransport = SerialPort(self.port, baud, self.clock)
        except DeviceMissing as error:
            raise DeviceMissing(f"{error}; choose one by --port: {_ports_here()}") from error
        if self.record is not None:
            transport = RecordingTransport(transport, self._recorder(self.record, baud))
        link = self.family.bench(transport, self.clock, baud)
        try:
            link.detect_echo()
            yield link
        finally:
            link.close()

    def _recorder(self, file: Path, baud: int) -> WireRecorder:
        """Return a recorder; each speed other than that of the bus gets its own file."""
        if baud != self.baud:
            file = file.with_name(f"{file.stem}-{baud}{file.suffix}")
        return WireRecorder(file, self.clock, note=f"{self.port} at {baud} baud")

    @property
    def speeds(self) -> tuple[int, ...]:
        """Return the speeds of the family that a tty offers too."""
        return tuple(speed for speed in SPEEDS if speed in self.family.baud_rates)

    @property
    def declared(self) -> dict[int, tuple[str, str]]:
        """Return joint and model of the servos in the robot file, by id; none without a file."""
        servos = self.robot.servo_bus.all_servos if self.robot else ()
        return {servo.id: (servo.joint, servo.model) for servo in servos}

    @property
    def joints(self) -> dict[int, str]:
        """Return the joint of each declared servo."""
        return {servo_id: joint for servo_id, (joint, _) in self.declared.items()}

    def joint(self, servo_id: int) -> str:
        """Return the joint that a servo drives, "" without a robot file."""
        return self.joints.get(servo_id, "")

    def label(self, servo_id: int) -> str:
        """Return how messages name a servo."""
        joint = self.joint(servo_id)
        return f"servo {servo_id} ({joint})" if joint else f"servo {servo_id}"


def _ports_here() -> str:
    """Return the serial ports of this machine, those with a persistent name first."""
    by_id = Path("/dev/serial/by-id")
    found = sorted(by_id.iterdir()) if by_id.is_dir() else []
    found += sorted(one for kind in SERIAL_NAMES for one in Path("/dev").glob(kind))
    return ", ".join(map(str, found)) or "this machine has none"


def add_bus_arguments(command: argparse.ArgumentParser) -> None:
    """Add the arguments that choose the bus."""
    command.add_argument("--robot", help="work on this robot's servo bus (default: butler)")
    command.add_argument("--port", type=Path, help="work on this port, such as /dev/ttyUSB0")
    command.add_argument(
        "--baud",
        type=int,
        choices=SPEEDS,
        metavar="N",
        help=f"speed in bit/s: {', '.join(map(str, SPEEDS))} "
        f"(default: the robot's, or {DEFAULT_BAUD} with --port)",
    )
    command.add_argument(
        "--family", choices=FAMILIES, help="of the servos (default: the robot's, or dynamixel)"
    )
    command.add_argument("--record", type=Path, metavar="FILE", help="record the wire to this file")
    command.add_argument("--json", action="store_true", help="print the result as JSON")


def bus_of(arguments: argparse.Namespace) -> ServoBusPort:
    """Return the bus that the arguments name.

    Raises:
        RobotFileError: the robot file has faults.
        UsageError: no servo of the family can have an id that they name.
    """
    is_port_alone = arguments.port is not None and arguments.robot is None
    robot = None if is_port_alone else load_robot(arguments.robot or "butler")
    bus = None if robot is None else robot.servo_bus
    family = servo_family(arguments.family or FAMILIES[0])
    if bus is not None and arguments.family is None:
        family = family_of(bus.servos[0].model)
    _require_ids(arguments, family)
    return ServoBusPort(
        port=arguments.port or Path(bus.path if bus else ""),
        baud=arguments.baud or (bus.baud if bus else DEFAULT_BAUD),
        family=family,
        baud_given=arguments.baud is not None,
        robot=robot,
        record=arguments.record,
    )


def _require_ids(arguments: argparse.Namespace, family: ServoFamily) -> None:
    given = vars(arguments)
    ids = [*(given.get("ids") or ()), *(given[key] for key in ("id", "new_id") if key in given)]
    for one in ids:
        if one > family.highest_id:
            raise UsageError(
                f"{family.name}: expected an id in 0..{family.highest_id}, got '{one}'"
            )


def chosen_joints(robot: RobotDescription, names: Sequence[str]) -> list[str]:
    """Return the named joints, all of them when none is named.

    Raises:
        UsageError: the robot has no such joint.
    """
    unknown = [name for name in names if name not in robot.joint_index]
    if unknown:
        known = ", ".join(robot.joint_names)
        raise UsageError(f"{robot.name} has no servo joint {', '.join(unknown)}; it has {known}")
    return list(names) or list(robot.joint_names)


def servo_id(text: str) -> int:
    """Read one id; whether a servo of the bus can have it, `bus_of` says.

    Raises:
        argparse.ArgumentTypeError: it is no whole number.
    """
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"expected a whole number from 0, got {text!r}")
    return int(text)


def confirm(
    arguments: argparse.Namespace, question: str, ask: Callable[[str], str] = input
) -> None:
    """Ask for confirmation before something that can hurt; `--yes` confirms it.

    Raises:
        UsageError: there is no terminal to ask at.
        CommandFailed: the answer is not yes.
    """
    if arguments.yes:
        return
    if not sys.stdin.isatty():
        raise UsageError(f"{question} Nobody can be asked here: repeat it with --yes")
    if ask(f"{question} Type yes to go on: ").strip().lower() != "yes":
        raise CommandFailed("nothing was changed")


def add_yes_argument(command: argparse.ArgumentParser) -> None:
    """Add the option that confirms every question."""
    command.add_argument("--yes", action="store_true", help="do not ask")


class ProgressLine:
    """Show progress at a terminal, on one line that is cleared at the end."""

    def __init__(self, *, quiet: bool) -> None:
        self._shown = not quiet and sys.stderr.isatty()

    def __call__(self, text: str) -> None:
        """Replace the text."""
        if self._shown:
            control(CLEAR_LINE, sys.stderr)
            print(text, end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Clear the line."""
        self("")
