"""Open a microphone or speaker by its path: a socket of PCM, a WAV file, else the sound system."""

from pathlib import Path

from drivers.audio.base import AudioFormat, AudioInput, AudioOutput
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from drivers.audio.portaudio import PortAudioInput, PortAudioOutput
from drivers.audio.wav import WavInput, WavOutput
from drivers.clock import Clock
from drivers.errors import WrongDevice
from drivers.socket_stream import SocketStream


def open_audio_input(path: str, clock: Clock, format_: AudioFormat) -> AudioInput:
    """Return the microphone.

    Raises:
        DeviceMissing: it is not there, cannot have this format, or a library is missing.
        WrongDevice: the file is no WAV file, or has another format.
    """
    if path.endswith(".wav"):
        file = WavInput(Path(path), clock)
        if file.format != format_:
            raise WrongDevice(f"{path}: {format_} declared, {file.format} got; convert it")
        return file
    if path.startswith("/"):
        return PcmInput(SocketStream(Path(path), clock), clock, format_)
    return PortAudioInput(path, clock, format_)


def open_audio_output(path: str, clock: Clock, format_: AudioFormat) -> AudioOutput:
    """Return the speaker.

    Raises:
        DeviceMissing: it is not there, cannot have this format, or a library is missing.
    """
    if path.endswith(".wav"):
        return WavOutput(Path(path), format_)
    if path.startswith("/"):
        return PcmOutput(SocketStream(Path(path), clock), clock, format_)
    return PortAudioOutput(path, format_)
