"""Say how a robot's microphone is opened: by its own path, or through the twin's wires."""

from collections.abc import Mapping
from functools import partial

from drivers.audio.base import AudioFormat, AudioInput
from drivers.audio.open_audio import open_audio_input
from drivers.audio.pcm_stream import PcmInput
from drivers.clock import Clock
from drivers.opener import DeviceLink, DeviceOpener
from vla_deploy.robots.description import Audio, RobotDescription
from vla_deploy.speech.microphone import OpenInput


def linked_microphone(
    robot: RobotDescription, links: Mapping[str, DeviceLink], clock: Clock
) -> OpenInput | None:
    """Return how to open the microphone by the path of its link; None where there is none."""
    audio = robot.microphone
    if audio is None:
        return None
    return partial(open_audio_input, links[audio.device].path, clock, format_of(audio))


def streamed_microphone(
    robot: RobotDescription, devices: DeviceOpener, clock: Clock
) -> OpenInput | None:
    """Return how to open the microphone as a stream, as lock-step does; None without one."""
    audio = robot.microphone
    if audio is None:
        return None
    declared = audio

    def connect() -> AudioInput:
        return PcmInput(devices.stream(declared.device), clock, format_of(declared))

    return connect


def format_of(audio: Audio) -> AudioFormat:
    """Return the format that a robot file declares."""
    return AudioFormat(rate_hz=audio.rate_hz, channels=audio.channels)
