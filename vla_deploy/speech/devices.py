"""Say how microphone and speaker are opened: by their own paths, or through the twin's wires."""

from collections.abc import Mapping
from functools import partial

from drivers.audio.base import AudioFormat, AudioInput, AudioOutput
from drivers.audio.open_audio import open_audio_input, open_audio_output
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from drivers.clock import Clock
from drivers.opener import DeviceLink, DeviceOpener
from vla_deploy.robots.description import Audio, RobotDescription
from vla_deploy.speech.microphone import OpenInput
from vla_deploy.speech.voice.mouth import OpenOutput


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


def linked_speaker(
    robot: RobotDescription, links: Mapping[str, DeviceLink], clock: Clock
) -> OpenOutput | None:
    """Return how to open the speaker by the path of its link; None where there is none."""
    audio = robot.speaker
    if audio is None:
        return None
    return partial(open_audio_output, links[audio.device].path, clock, format_of(audio))


def streamed_speaker(
    robot: RobotDescription, devices: DeviceOpener, clock: Clock
) -> OpenOutput | None:
    """Return how to open the speaker as a stream, as lock-step does; None without one."""
    audio = robot.speaker
    if audio is None:
        return None
    declared = audio

    def connect() -> AudioOutput:
        return PcmOutput(devices.stream(declared.device), clock, format_of(declared))

    return connect


def format_of(audio: Audio) -> AudioFormat:
    """Return the format that a robot file declares."""
    return AudioFormat(rate_hz=audio.rate_hz, channels=audio.channels)
