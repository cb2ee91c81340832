"""Switch the devices of the home: lamps, sockets and the like, on MQTT, HTTP and GPIO."""

from vla_deploy.devices.errors import DeviceAway, DeviceError, DeviceNotUsable, StateUnreadable
from vla_deploy.devices.home import (
    EXCHANGE_S,
    HomeDevices,
    open_home,
    transport_of,
    twin_broker_in,
)
from vla_deploy.devices.switched_device import DeviceTask, SwitchedDevice, SwitchState
from vla_deploy.devices.transport import DeviceReading, SwitchTransport

__all__ = [
    "EXCHANGE_S",
    "DeviceAway",
    "DeviceError",
    "DeviceNotUsable",
    "DeviceReading",
    "DeviceTask",
    "HomeDevices",
    "StateUnreadable",
    "SwitchState",
    "SwitchTransport",
    "SwitchedDevice",
    "open_home",
    "transport_of",
    "twin_broker_in",
]
