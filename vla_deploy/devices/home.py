"""Hold every device of the home that a robot file declares, each with its own way and executor."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import Final

from drivers.clock import Clock
from vla_deploy.devices.errors import DeviceNotUsable
from vla_deploy.devices.gpio_link import GpioLink
from vla_deploy.devices.http_link import HttpLink
from vla_deploy.devices.login import DeviceLogin, read_login
from vla_deploy.devices.mqtt_link import BrokerAddress, MqttLink
from vla_deploy.devices.switched_device import SwitchedDevice
from vla_deploy.devices.transport import DeviceReading, SwitchTransport
from vla_deploy.ipc.payloads.services import DevicesStatus, DeviceStatus
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.home_devices import BROKER_SOCKET, HomeDevice

EXCHANGE_S: Final = 0.05
"""What one exchange with a device takes of the twin's time."""
_MOST_FAULT: Final = 200
NewExecutor = Callable[[str], Executor]


class HomeDevices:
    """Be all devices of the home for a node that steps."""

    def __init__(self, devices: Iterable[SwitchedDevice], clock: Clock) -> None:
        self._devices = {one.device.name: one for one in devices}
        self._clock = clock

    def __iter__(self) -> Iterator[SwitchedDevice]:
        return iter(self._devices.values())

    def named(self, name: str) -> SwitchedDevice | None:
        """Return the device of that name in the robot file, None where there is none."""
        return self._devices.get(name)

    def refresh(self) -> None:
        """Take in what each device has told, and begin with what is next."""
        for device in self._devices.values():
            device.refresh()

    def document(self) -> DevicesStatus:
        """Return what is known of each device, as the topic `device_status` has it."""
        now_ns = self._clock.now_ns()
        return {"devices": [_status(one, now_ns) for one in self._devices.values()]}

    def close(self) -> None:
        """Let go of every device without waiting for any."""
        for device in self._devices.values():
            device.close()


def _status(device: SwitchedDevice, now_ns: int) -> DeviceStatus:
    state = device.state
    return {
        "name": device.device.name,
        "kind": device.device.kind.value,
        "place": device.device.place,
        "called": device.called,
        "where": device.where,
        "is_on": state.is_on,
        "age_s": round(state.age_s(now_ns), 3) if state.read_ns else None,
        "fault": state.fault[:_MOST_FAULT],
    }


def open_home(
    robot: RobotDescription,
    clock: Clock,
    new_executor: NewExecutor,
    twin_broker: Path | None = None,
) -> HomeDevices:
    """Return the devices of a robot's home; none is called yet, and none needs to be there.

    With `twin_broker`, the socket of a twin's broker, no device beyond the twin is reached.
    """
    return HomeDevices(
        (
            SwitchedDevice(one, transport_of(robot, one, twin_broker), new_executor(name), clock)
            for name, one in robot.devices.items()
        ),
        clock,
    )


def twin_broker_in(devices_dir: Path | None) -> Path | None:
    """Return the socket of the broker of a twin that serves its devices there."""
    return None if devices_dir is None else devices_dir / BROKER_SOCKET


def transport_of(
    robot: RobotDescription, device: HomeDevice, twin_broker: Path | None = None
) -> SwitchTransport:
    """Return the way to a device, in the twin's home where there is a `twin_broker`."""
    if device.mqtt is not None:
        assert robot.broker is not None, "the robot file was checked"
        if twin_broker is not None:
            return MqttLink(device.mqtt, BrokerAddress(str(twin_broker)))
        broker = robot.broker
        address = BrokerAddress(broker.host, broker.port, tls=broker.tls)
        return MqttLink(device.mqtt, address, _login(broker.credentials))
    if twin_broker is not None:
        return NotInTwin()
    if device.http is not None:
        return HttpLink(device.http, _login(device.http.credentials))
    assert device.gpio is not None, "the robot file was checked"
    return GpioLink(device.gpio)


def _login(file: Path | None) -> Callable[[], DeviceLogin] | None:
    return None if file is None else partial(read_login, file)


class NotInTwin:
    """Stand for a device that the twin does not have; the real one is not touched by its runs."""

    where = "the twin"
    called = ""
    look_period_s = 60.0

    def switch(self, on: bool) -> DeviceReading:
        """Refuse.

        Raises:
            DeviceNotUsable: always.
        """
        raise DeviceNotUsable("the twin has devices on MQTT alone, not on HTTP or GPIO")

    def read(self) -> DeviceReading:
        """Refuse.

        Raises:
            DeviceNotUsable: always.
        """
        return self.switch(False)

    def interrupt(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""
