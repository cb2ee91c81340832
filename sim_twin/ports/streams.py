"""List the emulated devices that a host reaches by a stream: the e-stop button, sound."""

from typing import Protocol

from drivers.audio.base import AudioFormat
from sim_twin.device import WireDevice
from sim_twin.sensors.estop import EstopButtonDevice
from sim_twin.sensors.sound import MicrophoneDevice, SpeakerDevice
from sim_twin.sound.room import Room
from vla_deploy.robots import RobotDescription


class StreamedDevice(WireDevice, Protocol):
    """Emulate a device whose hosts come and go."""

    def announce(self) -> None:
        """Begin anew for the next host."""
        ...


def streamed_devices(robot: RobotDescription, seed: int) -> dict[str, StreamedDevice]:
    """Return what the robot file declares, by device name.

    A button on GPIO is none of these: the twin has no GPIO lines.
    """
    devices: dict[str, StreamedDevice] = {}
    room: Room | None = None
    if robot.estop is not None and robot.estop.model == "HID":
        devices[robot.estop.device] = EstopButtonDevice(robot.estop.number)
    if (ear := robot.microphone) is not None:
        format_ = AudioFormat(rate_hz=ear.rate_hz, channels=ear.channels)
        microphone = MicrophoneDevice(format_, seed=seed)
        room = microphone.room
        devices[ear.device] = microphone
    if (mouth := robot.speaker) is not None:
        format_ = AudioFormat(rate_hz=mouth.rate_hz, channels=mouth.channels)
        devices[mouth.device] = SpeakerDevice(format_, room)
    return devices
