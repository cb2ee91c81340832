"""Speak by the engines that are installed; each is asked for one short text."""

import ctypes
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from training.voices import espeak, flite, kokoro, rhvoice
from training.voices.cast import HELD_OUT_VARIANTS, ROBOTIC_VARIANTS, VARIANTS, Speaker, say
from training.voices.clip import SpokenClip, Style
from training.voices.errors import EngineMissing, SynthesisFailed
from training.voices.phones import SILENCE


def _there(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


needs_espeak = pytest.mark.skipif(not _there("libespeak-ng.so.1"), reason="no libespeak-ng1")
needs_flite = pytest.mark.skipif(
    not _there("libflite.so.1") or shutil.which("flite") is None, reason="no flite"
)
ENGINES = [
    pytest.param("espeak", "en-us+f3", marks=needs_espeak),
    pytest.param("flite", "kal", marks=needs_flite),
]


def _phones(clip: SpokenClip) -> list[str]:
    return [one.phone for one in clip.sounds if one.phone != SILENCE]


@pytest.mark.parametrize(("engine", "voice"), ENGINES)
def test_a_clip_tells_its_sounds_in_order_and_in_time(engine: str, voice: str) -> None:
    clip = say("red cup", Speaker(engine=engine, voice=voice), Style())
    times_s = [one.began_s for one in clip.sounds]
    assert _phones(clip)[:4] == ["r", "eh", "d", "k"]
    assert times_s == sorted(times_s) and times_s[-1] <= clip.duration_s
    assert 0.3 < clip.duration_s < 3.0 and np.abs(clip.samples).max() > 0.1


@pytest.mark.parametrize(("engine", "voice"), ENGINES)
def test_a_hurried_voice_is_quicker(engine: str, voice: str) -> None:
    speaker = Speaker(engine=engine, voice=voice)
    slow, quick = (say("the blue ball", speaker, Style(rate_ratio=r)) for r in (0.8, 1.3))
    assert quick.duration_s < 0.85 * slow.duration_s


@needs_espeak
def test_an_unknown_voice_is_an_error_and_not_the_voice_of_before() -> None:
    espeak.speak("cup", "en-us", Style())
    with pytest.raises(SynthesisFailed, match="no such voice"):
        espeak.speak("cup", "en-xx", Style())


@needs_flite
def test_flite_names_the_voices_that_it_has() -> None:
    with pytest.raises(SynthesisFailed, match="kal16"):
        flite.speak("cup", "nobody", Style())


def test_nobody_is_both_trained_on_and_held_out() -> None:
    assert not {*VARIANTS, *ROBOTIC_VARIANTS} & set(HELD_OUT_VARIANTS)
    trained = {style for voice in kokoro.VOICES for style in re.split(r"[+~]", voice)}
    assert not trained & {*kokoro.DEVELOPMENT, *kokoro.JUDGED}
    assert not set(kokoro.DEVELOPMENT) & set(kokoro.JUDGED)


def test_without_rhvoice_it_is_said_where_to_get_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(rhvoice.ROOT, str(tmp_path))
    rhvoice._speaker.cache_clear()
    with pytest.raises(EngineMissing, match=f"libRHVoice.*name its folder in {rhvoice.ROOT}"):
        rhvoice.speak("hello", rhvoice.VOICES[0], Style())


@pytest.mark.parametrize("folder", ["", "nowhere"])
def test_without_its_styles_kokoro_says_where_to_get_them(
    monkeypatch: pytest.MonkeyPatch, folder: str
) -> None:
    monkeypatch.setenv(kokoro.FOLDER, folder)
    kokoro._table.cache_clear()
    with pytest.raises(EngineMissing, match=f"npm pack kokoro-js.*{kokoro.FOLDER}"):
        kokoro.style_vector(kokoro.JUDGED[0], 3)


@needs_espeak
def test_a_word_of_kokoro_is_found_by_how_long_its_tokens_last(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for style in ("af_sky", "bm_lewis"):
        np.zeros((kokoro._LONGEST + 1, 256), "<f4").tofile(tmp_path / f"{style}.bin")
    monkeypatch.setenv(kokoro.FOLDER, str(tmp_path))
    kokoro._table.cache_clear()

    def four_frames_each(
        tokens: list[int], style: np.ndarray, rate_ratio: float
    ) -> tuple[np.ndarray, np.ndarray]:
        frames = np.full(len(tokens), 4.0, np.float32)
        return np.full(int(600 * frames.sum()), 0.2, np.float32), frames

    monkeypatch.setattr(kokoro, "synthesise", four_frames_each)
    for voice, vowel in (("af_sky", "aa"), ("bm_lewis+af_sky", "aa"), ("af_sky~bm_lewis", "aa")):
        clip = kokoro.speak("please stop!", voice, Style())
        assert _phones(clip) == ["p", "l", "iy", "z", "s", "t", vowel, "p"]
        starts_s = {sound.phone: sound.began_s for sound in clip.sounds}
        assert starts_s["aa"] == pytest.approx(starts_s["t"] + 0.1)
