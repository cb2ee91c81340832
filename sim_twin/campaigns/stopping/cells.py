"""Declare what stops the robot while it does what: the table of the certificate of stops."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Final


class StopSource(Enum):
    """Name what stops the robot, in lock-step on the twin's time."""

    REQUEST = "request"
    BUTTON = "button"
    OPERATOR_STOP = "operator_stop"
    PROTECTIVE = "protective"
    SERVO_BUS = "servo_bus_lost"
    CAN_BUS = "can_bus_lost"
    SUPERVISOR = "supervisor_lost"
    CONTROL = "control_killed"


class StopPhase(Enum):
    """Name what the robot does when it is stopped."""

    STANDING = "standing"
    DRIVING = "driving"
    ARM_MOVING = "arm_moving"
    PLACING = "placing"


class HandLoad(Enum):
    """Name what is in the hand."""

    EMPTY = "empty"
    CARRYING = "carrying"


class WallSource(Enum):
    """Name from where real processes are asked to stop, by the wall clock."""

    REQUEST = "request"
    PAGE = "page"
    DOOR = "door"
    CLI = "cli"
    BUTTON = "button"


class CpuLoad(Enum):
    """Name what else the computer does."""

    IDLE = "idle"
    BUSY = "busy"


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceRule:
    """Hold by which category a source stops the robot, and what must follow.

    `notice_s` is until when the stop must have begun. `proves` is what control must say of it:
    nothing where control is gone, failed where it can measure no more.
    """

    category: str
    notice_s: float
    proves: str
    meaning: str


SOURCES: Final[Mapping[StopSource, SourceRule]] = {
    StopSource.REQUEST: SourceRule(
        category="1, arms 2",
        notice_s=0.02,
        proves="verified",
        meaning="the ring that page, stop door, command line, voice and ROS press",
    ),
    StopSource.BUTTON: SourceRule(
        category="1, arms 2",
        notice_s=0.02,
        proves="verified",
        meaning="the HID button, emulated at the kernel's input interface",
    ),
    StopSource.OPERATOR_STOP: SourceRule(
        category="2",
        notice_s=0.02,
        proves="verified",
        meaning="what the executor sends at `vla-deploy stop`",
    ),
    StopSource.PROTECTIVE: SourceRule(
        category="2", notice_s=0.02, proves="verified", meaning="a budget that demands a stop"
    ),
    StopSource.SERVO_BUS: SourceRule(
        category="2", notice_s=0.2, proves="failed", meaning="the servos' cable is out"
    ),
    StopSource.CAN_BUS: SourceRule(
        category="2", notice_s=0.2, proves="failed", meaning="the wheel drives' cable is out"
    ),
    StopSource.SUPERVISOR: SourceRule(
        category="2", notice_s=0.02, proves="verified", meaning="its process table is too old"
    ),
    StopSource.CONTROL: SourceRule(
        category="by the devices",
        notice_s=0.0,
        proves="",
        meaning="kill -9 of control: watchdog of the servos, heartbeat of the drives",
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class StopCell:
    """Name one cell of the twin's time."""

    source: StopSource
    payload: HandLoad
    phase: StopPhase

    @property
    def name(self) -> str:
        """Return the cell in words."""
        return f"{self.source.value}/{self.payload.value}/{self.phase.value}"

    @property
    def seed(self) -> int:
        """Return what its moments are drawn from, beside the campaign's seed."""
        places = [list(type(one)).index(one) for one in (self.source, self.payload, self.phase)]
        return sum(place * factor for place, factor in zip(places, (100, 10, 1), strict=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class WallCell:
    """Name one cell of the wall clock."""

    source: WallSource
    load: CpuLoad

    @property
    def name(self) -> str:
        """Return the cell in words."""
        return f"wire/{self.source.value}/{self.load.value}"


def cells() -> Iterator[StopCell]:
    """Return every cell that there can be."""
    for source in StopSource:
        for payload in HandLoad:
            for phase in StopPhase:
                if phase is not StopPhase.PLACING or payload is HandLoad.CARRYING:
                    yield StopCell(source=source, payload=payload, phase=phase)


def wall_cells() -> list[WallCell]:
    """Return every cell of the wall clock, those of one load side by side."""
    return [WallCell(source=source, load=load) for load in CpuLoad for source in WallSource]


SHORT: Final = (
    "request/empty/driving",
    "button/empty/arm_moving",
    "can_bus_lost/empty/driving",
    "control_killed/empty/driving",
    "control_killed/empty/arm_moving",
    "wire/request/idle",
    "wire/page/idle",
    "wire/door/idle",
)
"""What the short form plays."""
NOT_TRIED: Final[Mapping[str, str]] = {
    "gpio_button": "a GPIO pin needs the pin: tests/drivers/estop holds its driver to the kernel's "
    "wire",
    "voice": "from the last word to the latch: vla-deploy bench speech",
    "ros": "needs a ROS 2 beside the robot: vla-deploy bench ros",
    "category_0": "no robot file that is shipped takes the power of a moving part at once",
    "empty/placing": "there is nothing to place",
}
"""What no form of the campaign plays, and where else it is looked at."""
