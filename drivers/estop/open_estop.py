"""Open an emergency-stop input by the model that the robot file names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from drivers.clock import Clock
from drivers.errors import UnknownModel
from drivers.estop.base import EstopInput
from drivers.estop.gpio_button import GpioButton
from drivers.estop.hid_button import HidButton

if TYPE_CHECKING:  # the opener loads python-can, which who only reads a robot file never needs
    from drivers.opener import DeviceOpener

    Open = Callable[[DeviceOpener, str, int, Clock], EstopInput]


def _hid(devices: DeviceOpener, name: str, number: int, clock: Clock) -> EstopInput:
    return HidButton(devices.input_events(name), clock, number)


def _gpio(devices: DeviceOpener, name: str, number: int, clock: Clock) -> EstopInput:
    return GpioButton(devices.gpio_contact(name, number), clock)


MODELS: Final[Mapping[str, Open]] = MappingProxyType({"HID": _hid, "GPIO": _gpio})


def open_estop(
    model: str, devices: DeviceOpener, name: str, clock: Clock, *, number: int
) -> EstopInput:
    """Return the driver of a button; `number` is the key's code, or the GPIO line's offset.

    Raises:
        UnknownModel: no driver knows the model.
        DeviceMissing: the device is not there.
        DeviceBusy: another process holds it.
    """
    if model not in MODELS:
        raise UnknownModel(
            f"no driver for the e-stop {model!r}; there are drivers for {', '.join(MODELS)}"
        )
    return MODELS[model](devices, name, number, clock)
