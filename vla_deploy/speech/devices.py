"""Say how microphone and speaker are opened: by the paths of their own links."""

from collections.abc import Mapping
from functools import partial

from drivers.audio.base import AudioFormat
from drivers.audio.open_audio import open_audio_input, open_audio_output
from drivers.clock import Clock
from drivers.opener import DeviceLink
from vla_deploy.robots.description import Audio, RobotDescription
from vla_deploy.speech.microphone import OpenInput
from vla_deploy.speech.voice.audio_player import OpenOutput

Links = Mapping[str, DeviceLink]


def linked_microphone(robot: RobotDescription, links: Links, clock: Clock) -> OpenInput | None:
    """Return how to open the microphone by the path of its link; None where there is none."""
    audio = robot.microphone
    if audio is None:
        return None
    return partial(open_audio_input, links[audio.device].path, clock, format_of(audio))


def linked_speaker(robot: RobotDescription, links: Links, clock: Clock) -> OpenOutput | None:
    """Return how to open the speaker by the path of its link; None where there is none."""
    audio = robot.speaker
    if audio is None:
        return None
    return partial(open_audio_output, links[audio.device].path, clock, format_of(audio))


def format_of(audio: Audio) -> AudioFormat:
    """Return the format that a robot file declares."""
    return AudioFormat(rate_hz=audio.rate_hz, channels=audio.channels)
