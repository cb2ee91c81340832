"""Open a relay by the model that the robot file names."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Final

from drivers.clock import Clock
from drivers.errors import UnknownModel
from drivers.power_relay.base import PowerRelay, RelayOpener
from drivers.power_relay.lcus_relay import LcusRelay
from drivers.power_relay.pulsed_relay import PulsedRelay

PULSED: Final = "GPIO"
"""The model that is fail-safe: its board falls without pulses."""


def _gpio(devices: RelayOpener, name: str, number: int, clock: Clock) -> PowerRelay:
    del clock
    return PulsedRelay(devices.gpio_output(name, number))


def _lcus(devices: RelayOpener, name: str, number: int, clock: Clock) -> PowerRelay:
    return LcusRelay(devices.serial(name), clock, number)


RELAY_MODELS: Final[Mapping[str, Callable[[RelayOpener, str, int, Clock], PowerRelay]]] = (
    MappingProxyType({PULSED: _gpio, "LCUS-1": _lcus})
)


def open_relay(
    model: str, devices: RelayOpener, name: str, clock: Clock, *, number: int
) -> PowerRelay:
    """Return the driver of a relay; `number` is the GPIO line's offset, or the channel.

    Raises:
        UnknownModel: no driver knows the model.
        DeviceMissing: the device is not there.
        DeviceBusy: another process holds it.
    """
    if model not in RELAY_MODELS:
        raise UnknownModel(
            f"no driver for the relay {model!r}; there are drivers for {', '.join(RELAY_MODELS)}"
        )
    return RELAY_MODELS[model](devices, name, number, clock)
