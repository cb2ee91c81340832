"""Open a robot's microphone and speaker as streams of the twin, as lock-step does."""

from drivers.audio.pcm_stream import PcmInput, PcmOutput
from drivers.clock import Clock
from drivers.opener import DeviceOpener
from vla_deploy.robots.description import RobotDescription
from vla_deploy.speech.microphone import OpenInput, format_of
from vla_deploy.speech.voice.audio_player import OpenOutput


def streamed_microphone(
    robot: RobotDescription, devices: DeviceOpener, clock: Clock
) -> OpenInput | None:
    """Return how to open the microphone; None where there is none."""
    audio = robot.microphone
    if audio is None:
        return None
    name, format_ = audio.device, format_of(audio)
    return lambda: PcmInput(devices.stream(name), clock, format_)


def streamed_speaker(
    robot: RobotDescription, devices: DeviceOpener, clock: Clock
) -> OpenOutput | None:
    """Return how to open the speaker; None where there is none."""
    audio = robot.speaker
    if audio is None:
        return None
    name, format_ = audio.device, format_of(audio)
    return lambda: PcmOutput(devices.stream(name), clock, format_)
