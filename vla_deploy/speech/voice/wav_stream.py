"""Read the WAV that a program writes to a pipe: its header tells lengths that it cannot know."""

import struct
from typing import Final

import numpy as np

from vla_deploy.speech.voice.clip import Clip, Wave
from vla_deploy.speech.voice.errors import SynthesisFailed

_RIFF: Final = struct.Struct("<4sI4s")
_CHUNK: Final = struct.Struct("<4sI")
_FORMAT: Final = struct.Struct("<HHIIHH")
_PCM: Final = 1
_BITS: Final = 16


def read_wav_stream(data: bytes) -> Clip:
    """Return the sound: what follows the header of `data`, to the end of what is there.

    Raises:
        SynthesisFailed: it is no WAV of 16-bit samples, or has none.
    """
    if len(data) < _RIFF.size or _RIFF.unpack_from(data)[::2] != (b"RIFF", b"WAVE"):
        raise SynthesisFailed(f"expected a WAV, got {data[:12]!r}")
    rate_hz, channels = 0, 0
    at = _RIFF.size
    while at + _CHUNK.size <= len(data):
        name, length = _CHUNK.unpack_from(data, at)
        at += _CHUNK.size
        if name == b"fmt ":
            rate_hz, channels = _format(data[at : at + length])
        elif name == b"data" and rate_hz:
            return Clip(rate_hz=rate_hz, wave=pcm_wave(data[at : at + length], channels))
        at += length + length % 2
    raise SynthesisFailed(f"expected a WAV with a format and samples, got {len(data)} bytes")


def pcm_wave(data: bytes, channels: int = 1) -> Wave:
    """Return 16-bit little-endian samples as one wave, the mean of the channels.

    Raises:
        SynthesisFailed: there is not one whole row.
    """
    row_bytes = 2 * channels
    whole = len(data) - len(data) % row_bytes
    if not whole:
        raise SynthesisFailed("expected sound, got no sample")
    rows = np.frombuffer(data[:whole], "<i2").reshape(-1, channels)
    wave: Wave = (rows.mean(axis=1) / 32_768.0).astype(np.float32)
    return wave


def _format(chunk: bytes) -> tuple[int, int]:
    if len(chunk) < _FORMAT.size:
        raise SynthesisFailed("expected the format of the samples, got half of it")
    kind, channels, rate_hz, _, _, bits = _FORMAT.unpack_from(chunk)
    if kind != _PCM or bits != _BITS or not channels or not rate_hz:
        raise SynthesisFailed(
            f"expected PCM of {_BITS} bits, got kind {kind}, {bits} bits, {channels} channels, "
            f"{rate_hz} Hz"
        )
    return rate_hz, channels
