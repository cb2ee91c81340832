"""Any Whisper in CTranslate2's form is read, and whatever is wrong with one is told in words."""

import dataclasses
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.clock import MonotonicClock
from platforms import ModelChoice
from vla_deploy.inference.errors import ModelFileSpoiled, ProviderUnavailable, RunFailed
from vla_deploy.inference.manifest import EncoderContext
from vla_deploy.inference.store import ModelStore
from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.recogniser import Recogniser, open_recogniser
from vla_deploy.speech.transcript import others_of

CHOICE = ModelChoice(
    tiers=("ours",),
    providers=("CPUExecutionProvider",),
    precision="int8",
    threads=1,
    cpu_fallback=False,
    memory_arena=True,
)
SECOND = np.zeros(16_000, np.float32)


def opened(folder: Path, choice: ModelChoice = CHOICE) -> Recogniser:
    store = ModelStore(folder.parent, embedded=folder.parent / "none")
    return open_recogniser(store.load(folder.name), choice, beam=1, clock=MonotonicClock())


@pytest.mark.parametrize("context", [EncoderContext.TRIMMED, EncoderContext.PADDED])
def test_a_text_is_read_with_what_speaks_for_it(
    scripted_whisper: Any, context: EncoderContext
) -> None:
    folder = scripted_whisper.model("ours", "pick up the red cup", context=context)
    recogniser = opened(folder)
    reading = recogniser.read(SECOND)
    assert reading.text == "pick up the red cup"
    assert -0.3 < reading.log_probability <= 0.0
    assert reading.no_speech < 0.1
    assert reading.language == "en"
    recogniser.close()
    with pytest.raises(RunFailed, match="closed"):
        recogniser.read(SECOND)


class _Spied:
    """Let a test see what a model is asked."""

    def __init__(self, model: Any, **ways: Any) -> None:
        self._model = model
        vars(self).update(ways)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)


def encoded(recogniser: Recogniser, *sounds: Any) -> list[tuple[int, int]]:
    """Read sounds; return how many frames of features and of states each has."""
    model, found = recogniser._whisper, []
    encode = model.model.encode

    def spied(features: Any, *, to_cpu: bool = False) -> Any:
        found.append((features.shape[-1], encode(features, to_cpu=True).shape[1]))
        return encode(features, to_cpu=to_cpu)

    model.model = _Spied(model.model, encode=spied)
    for sound in sounds:
        recogniser.read(sound)
    return found


@pytest.mark.parametrize(
    ("context", "frames"), [(EncoderContext.TRIMMED, 140), (EncoderContext.PADDED, 3000)]
)
def test_trimmed_sound_costs_a_small_part_of_a_padded_window(
    scripted_whisper: Any, context: EncoderContext, frames: int
) -> None:
    recogniser = opened(scripted_whisper.model("ours", "turn left", context=context))
    ((found, _),) = encoded(recogniser, SECOND)
    assert found == frames


def test_no_length_of_sound_is_encoded_twice(scripted_whisper: Any) -> None:
    """CTranslate2 takes states for features where there are as many of them as mel bands."""
    recogniser = opened(scripted_whisper.model("ours", "turn left", context=EncoderContext.TRIMMED))
    sounds = [np.zeros(16 * milliseconds, np.float32) for milliseconds in range(1100, 1300, 20)]
    mel_bands = recogniser._whisper.feature_extractor.mel_filters.shape[0]
    states = [count for _, count in encoded(recogniser, *sounds)]
    assert mel_bands - 1 in states, "the lengths around it were tried"
    assert mel_bands not in states


def test_what_may_have_been_said_instead_is_told_the_likeliest_first() -> None:
    readings = [("red cup", -1.0), ("red cup", -1.1), ("bad cup", -3.0), ("", -3.1),
                ("red cap", -1.7), ("led cup", -9.0)]  # fmt: skip
    assert list(others_of(readings)) == [
        ("red cap", pytest.approx(0.4966, abs=1e-4)),
        ("bad cup", pytest.approx(0.1353, abs=1e-4)),
    ]
    assert others_of(readings[:1]) == ()


def test_a_wide_search_tells_other_readings_than_the_best(scripted_whisper: Any) -> None:
    folder = scripted_whisper.model("ours", "pick up the red cup")
    store = ModelStore(folder.parent, embedded=folder.parent / "none")
    model = store.load(folder.name)
    recogniser = open_recogniser(model, CHOICE, beam=5, clock=MonotonicClock())
    reading = recogniser.read(SECOND)
    recogniser.close()
    assert reading.text == "pick up the red cup"
    assert all(text != reading.text and 0 < odds <= 1 for text, odds in reading.others)


@pytest.mark.parametrize(("languages", "detections", "language"), [
    (("en",), 0, "en"), (("de",), 0, "de"), (("en", "fr"), 1, "fr"),
])  # fmt: skip
def test_the_language_is_found_out_only_where_several_are_declared(
    scripted_whisper: Any, languages: tuple[str, ...], detections: int, language: str
) -> None:
    recogniser = opened(scripted_whisper.model("ours", "tournez a gauche"))
    recogniser.declared = dataclasses.replace(recogniser.declared, languages=languages)
    asked: list[str] = []

    model = recogniser._whisper
    heard = [[("<|fr|>", 0.97), ("<|en|>", 0.03)]]

    def detect(_: Any) -> Any:
        asked.append("")
        return heard

    model.model = _Spied(model.model, is_multilingual=True, detect_language=detect)
    assert recogniser.read(SECOND).language == language
    assert len(asked) == detections


def test_an_unsure_model_has_a_low_log_probability(scripted_whisper: Any) -> None:
    reading = opened(scripted_whisper.model("ours", "pick up the red cup", 0.6)).read(SECOND)
    assert reading.log_probability < -1.5


def test_a_half_written_model_is_refused_before_it_is_loaded(scripted_whisper: Any) -> None:
    folder = scripted_whisper.model("ours", "turn left")
    weights = folder / "model.bin"
    weights.write_bytes(weights.read_bytes()[:1000])
    with pytest.raises(ModelFileSpoiled, match=r"model\.bin: expected SHA-256"):
        opened(folder)


def test_files_that_are_no_whisper_are_told(scripted_whisper: Any) -> None:
    folder = scripted_whisper.write("ours", "turn left")
    (folder / "model.bin").write_bytes(b"nothing of the kind")
    declared = scripted_whisper.model("other", "turn left")
    text = (declared / "model.toml").read_text().replace('"other"', '"ours"')
    for path in folder.iterdir():
        from vla_deploy.inference.store import sha256_of

        text = text.replace(sha256_of(declared / path.name), sha256_of(path))
    (folder / "model.toml").write_text(text)
    with pytest.raises(ModelFileSpoiled, match="converted by CTranslate2"):
        opened(folder)


def test_what_nothing_here_can_run_is_refused(scripted_whisper: Any) -> None:
    folder = scripted_whisper.model("ours", "turn left")
    for change in ({"precision": "int4"}, {"providers": ("CUDAExecutionProvider",)}):
        with pytest.raises(ProviderUnavailable, match="CTranslate2 here runs nothing of"):
            opened(folder, dataclasses.replace(CHOICE, **change))


def test_a_missing_extra_is_told(scripted_whisper: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = scripted_whisper.model("ours", "turn left")
    monkeypatch.delitem(sys.modules, "vla_deploy.speech.whisper_runtime", raising=False)
    monkeypatch.setitem(sys.modules, "faster_whisper", None)
    with pytest.raises(SpeechMissing, match=r"pip install 'vla-deploy\[speech\]'"):
        opened(folder)
