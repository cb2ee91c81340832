"""Read from a robot file which joints may be driven against their stops to be calibrated."""

from collections.abc import Callable, Iterator, Mapping
from typing import Final

from drivers.servo.tools.travel import StopApproach
from vla_deploy.robots.consistency import Document, rows, subtables, table, unknown_name
from vla_deploy.robots.kinematics.mjcf import MjcfNames
from vla_deploy.runtime.table_schema import TABLE, Shape, TableFault, number

_KEY: Final = "calibration.against_stops"
CALIBRATION: Shape = {"against_stops": TABLE.optional}
STOP_APPROACH: Shape = {
    "torque_ratio": number(0.05, 0.5),
    "speed_rad_s": number(0.1, 1.0, "rad/s", kind="a speed"),
    "tolerance_rad": number(0.01, 0.2, "rad", kind="an angle").optional,
}
SHAPES: Final[Mapping[str, Shape]] = {"calibration": CALIBRATION, f"{_KEY}.*": STOP_APPROACH}


def read_approaches(document: Document) -> dict[str, StopApproach]:
    """Return how joints are driven against their stops, by joint."""
    return {name: StopApproach(**row) for name, row in _approaches(document).items()}


def one_servo_turns_each(document: Document) -> Iterator[TableFault]:
    """Each joint that is driven against its stops is turned by one servo alone."""
    bus = table(document, "servo_bus")
    joints = {row.get("joint") for row in rows(bus, "servos")}
    shadowed = {row.get("joint") for row in rows(bus, "shadows")}
    for name in _approaches(document):
        key = f"{_KEY}.{name}"
        if name not in joints:
            known = sorted(one for one in joints if isinstance(one, str))
            yield unknown_name(key, name, "a servo's joint", known)
        elif name in shadowed:
            yield TableFault(
                key=key, got="a joint with a shadow", expected="one that a single servo turns"
            )


def missing_stops(document: Document, mjcf: MjcfNames) -> Iterator[TableFault]:
    """Yield each joint that is driven against stops that the MJCF does not have."""
    for name in _approaches(document):
        if name in mjcf.joint_ranges and mjcf.joint_ranges[name] is None:
            yield TableFault(
                key=f"{_KEY}.{name}", got="a joint without a range", expected="one with stops"
            )


CHECKS: Final[tuple[Callable[[Document], Iterator[TableFault]], ...]] = (one_servo_turns_each,)


def _approaches(document: Document) -> dict[str, Document]:
    return subtables(table(document, "calibration"), "against_stops")
