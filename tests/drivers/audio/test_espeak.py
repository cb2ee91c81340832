"""The programs that speak: what they give, and every way in which they give nothing."""

import struct
from pathlib import Path

import numpy as np
import pytest

from drivers.audio.base import AudioFormat
from drivers.audio.clip import Clip, read_wav_stream
from drivers.audio.espeak import EspeakEngine
from drivers.errors import VoiceError


def wav(rows: bytes, *, channels: int = 1, bits: int = 16, told_bytes: int = 0x7FFFF000) -> bytes:
    form = struct.pack("<HHIIHH", 1, channels, 8_000, 16_000 * channels, 2 * channels, bits)
    chunks = b"".join(
        (b"LIST", struct.pack("<I", 3), b"abc\0", b"fmt ", struct.pack("<I", 16), form)
    )
    return (
        b"".join(
            (
                b"RIFF",
                struct.pack("<I", 36),
                b"WAVE",
                chunks,
                b"data",
                struct.pack("<I", told_bytes),
            )
        )
        + rows
    )


def test_espeak_speaks_and_faster_is_shorter() -> None:
    slow = EspeakEngine(words_per_minute=120).synthesise("put it in the box")
    fast = EspeakEngine(words_per_minute=220).synthesise("put it in the box")
    assert 0.4 < fast.duration_s < slow.duration_s < 4.0
    assert np.abs(slow.wave).max() > 0.1


def test_text_is_never_taken_for_an_option_or_for_phonemes() -> None:
    plain = EspeakEngine().synthesise("-v nothing")
    assert plain.duration_s > 0.5
    spelt = EspeakEngine().synthesise("[[h@l'oU]] robot")
    assert spelt.duration_s > EspeakEngine().synthesise("robot").duration_s


def test_a_missing_program_says_how_to_get_it(tmp_path: Path) -> None:
    with pytest.raises(VoiceError, match="apt install espeak-ng"):
        EspeakEngine(program=str(tmp_path / "none")).synthesise("hello")
    (tmp_path / "plain").write_text("text")
    with pytest.raises(VoiceError, match="Permission denied"):
        EspeakEngine(program=str(tmp_path / "plain")).synthesise("hello")


def test_an_unknown_voice_is_told_in_the_programs_words() -> None:
    with pytest.raises(VoiceError, match="voice does not exist"):
        EspeakEngine(voice="klingon-orc").synthesise("hello")


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "expected a WAV"),
        (b"<html>not found</html>", "expected a WAV"),
        (wav(b""), "got 0 samples"),
        (wav(b"\0" * 8, bits=24), "24 bits"),
        (wav(b"\0" * 8, channels=2), "2 channels"),
        (wav(b"\0" * 8)[:30], "expected a WAV"),
    ],
)
def test_what_is_no_sound_is_refused(data: bytes, told: str) -> None:
    with pytest.raises(VoiceError, match=told):
        read_wav_stream(data)


def test_lengths_in_the_header_are_not_believed() -> None:
    rows = struct.pack("<4h", 0, 16_384, -16_384, 8_192)
    assert read_wav_stream(wav(rows)).wave.tolist() == [0.0, 0.5, -0.5, 0.25]
    assert read_wav_stream(wav(rows + b"\1")).wave.tolist() == [0.0, 0.5, -0.5, 0.25]


@pytest.mark.parametrize(("rate_hz", "new_rate_hz"), [(22_050, 16_000), (8_000, 48_000)])
def test_another_rate_keeps_a_tone_and_the_time(rate_hz: int, new_rate_hz: int) -> None:
    def tone(rate: int) -> np.ndarray:
        times_s = np.arange(rate) / rate
        return (np.sin(2 * np.pi * 440 * times_s) * np.sin(np.pi * times_s)).astype(np.float32)

    changed = Clip(rate_hz=rate_hz, wave=tone(rate_hz)).at_rate(new_rate_hz)
    assert changed.duration_s == pytest.approx(1.0)
    assert changed.wave == pytest.approx(tone(new_rate_hz), abs=0.01)


def test_a_speaker_gets_every_channel_at_its_volume_and_never_wraps() -> None:
    sound = Clip(rate_hz=8_000, wave=np.array([0.5, -1.0, 2.0], np.float32))
    samples = sound.samples(AudioFormat(rate_hz=8_000, channels=2), 0.5)
    assert samples.tolist() == [[8_192, 8_192], [-16_384, -16_384], [32_767, 32_767]]
