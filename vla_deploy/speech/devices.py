"""Say how microphone and speaker are opened: by their own paths, or through the twin's wires."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TypeVar

from drivers.audio.base import AudioFormat
from drivers.audio.open_audio import open_audio_input, open_audio_output
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from drivers.base import ByteTransport
from drivers.clock import Clock
from drivers.opener import DeviceLink, DeviceOpener
from vla_deploy.robots.description import Audio, RobotDescription
from vla_deploy.speech.microphone import OpenInput
from vla_deploy.speech.voice.audio_player import OpenOutput

T = TypeVar("T")


def linked_microphone(
    robot: RobotDescription, links: Mapping[str, DeviceLink], clock: Clock
) -> OpenInput | None:
    """Return how to open the microphone by the path of its link; None where there is none."""
    return _linked(open_audio_input, robot.microphone, links, clock)


def streamed_microphone(
    robot: RobotDescription, devices: DeviceOpener, clock: Clock
) -> OpenInput | None:
    """Return how to open the microphone as a stream, as lock-step does; None without one."""
    return _streamed(PcmInput, robot.microphone, devices, clock)


def linked_speaker(
    robot: RobotDescription, links: Mapping[str, DeviceLink], clock: Clock
) -> OpenOutput | None:
    """Return how to open the speaker by the path of its link; None where there is none."""
    return _linked(open_audio_output, robot.speaker, links, clock)


def streamed_speaker(
    robot: RobotDescription, devices: DeviceOpener, clock: Clock
) -> OpenOutput | None:
    """Return how to open the speaker as a stream, as lock-step does; None without one."""
    return _streamed(PcmOutput, robot.speaker, devices, clock)


def _linked(
    open_path: Callable[[str, Clock, AudioFormat], T],
    audio: Audio | None,
    links: Mapping[str, DeviceLink],
    clock: Clock,
) -> Callable[[], T] | None:
    if audio is None:
        return None
    return partial(open_path, links[audio.device].path, clock, format_of(audio))


def _streamed(
    connect: Callable[[ByteTransport, Clock, AudioFormat], T],
    audio: Audio | None,
    devices: DeviceOpener,
    clock: Clock,
) -> Callable[[], T] | None:
    if audio is None:
        return None
    declared = audio
    return lambda: connect(devices.stream(declared.device), clock, format_of(declared))


def format_of(audio: Audio) -> AudioFormat:
    """Return the format that a robot file declares."""
    return AudioFormat(rate_hz=audio.rate_hz, channels=audio.channels)
