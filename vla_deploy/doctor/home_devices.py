"""Check that each device of the home answers, and tells a state that can be read."""

from collections.abc import Iterator
from contextlib import closing
from typing import Final

from vla_deploy.devices import DeviceError, SwitchTransport, transport_of
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, ok, warn

_LOOK: Final = "vla-deploy devices --robot {}   # docs/devices.md"


def reachable(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Ask each device for its state; the stack runs without them."""
    if context.robot is None:
        return
    for name, device in context.robot.devices.items():
        yield _judged(context.robot.name, name, transport_of(context.robot, device))


def _judged(robot: str, name: str, transport: SwitchTransport) -> DoctorFinding:
    with closing(transport):
        try:
            reading = transport.read()
        except DeviceError as error:
            return warn(name, str(error), _LOOK.format(robot))
    return ok(name, f"{'on' if reading.is_on else 'off'}, {transport.where}")
