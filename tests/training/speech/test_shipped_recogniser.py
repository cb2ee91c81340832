"""Hold the recogniser that is shipped to its card; it is read as the robot reads."""

import ctypes
from collections.abc import Iterator

import numpy as np
import pytest

from drivers.clock import MonotonicClock
from training.speech.card import AIMS, METRICS, read_metrics, verdict
from training.speech.clips.sentences import normal
from training.speech.shipping import BEAM, CARD, LEAST_CONFIDENCE, SHIPPED
from training.speech.trials import heard, noises_alone
from training.voices.cast import Speaker, say
from training.voices.clip import SpokenClip, Style
from vla_deploy.inference.manifest_file import read_manifest
from vla_deploy.inference.store import StoredModel
from vla_deploy.model_tools.whispers import PLAIN_CHOICE
from vla_deploy.speech.recogniser import Recogniser, open_recogniser
from vla_deploy.speech.transcript import confidence

pytest.importorskip("faster_whisper")
pytestmark = pytest.mark.skipif(not (SHIPPED / METRICS).exists(), reason="none is shipped yet")

COMMANDS = ("pick up the red cup and put it in the box", "go to the kitchen", "stop")


@pytest.fixture(scope="module")
def recogniser() -> Iterator[Recogniser]:
    model = StoredModel(manifest=read_manifest(SHIPPED), folder=SHIPPED, is_embedded=True)
    opened = open_recogniser(model, PLAIN_CHOICE, beam=BEAM, clock=MonotonicClock())
    yield opened
    opened.close()


def by_espeak(text: str, seed: int, snr_db: float) -> SpokenClip:
    """Return a text as eSpeak says it, heard in noise; the test is skipped where there is none."""
    try:
        ctypes.CDLL("libespeak-ng.so.1")
    except OSError:
        pytest.skip("no libespeak-ng1")
    spoken = say(text, Speaker(engine="espeak", voice="en-us"), Style())
    return heard(spoken, np.random.default_rng(seed), snr_db)


@pytest.mark.parametrize("text", COMMANDS)
def test_plain_commands_are_read_right_and_surely(recogniser: Recogniser, text: str) -> None:
    reading = recogniser.read(by_espeak(text, 0, 20.0).samples)
    assert normal(reading.text) == normal(text)
    assert confidence(reading, recogniser.declared.calibration) >= LEAST_CONFIDENCE


def test_a_command_is_read_right_at_any_length(recogniser: Recogniser) -> None:
    clip = by_espeak("turn left by ninety degrees", 0, 30.0)
    rate_hz, step_s = 16_000, 0.04
    counts = [round(rate_hz * step_s * number) for number in range(35)]
    read = {recogniser.read(np.pad(clip.samples, (count, 0))).text for count in counts}
    assert {normal(one) for one in read} == {clip.text}


def test_noise_gives_no_sure_words(recogniser: Recogniser) -> None:
    for clip in noises_alone(8, np.random.default_rng(1)):
        reading = recogniser.read(clip.samples)
        assert confidence(reading, recogniser.declared.calibration) < LEAST_CONFIDENCE, clip.voice


def test_the_card_tells_its_figures_and_what_it_never_heard() -> None:
    text = (SHIPPED / CARD).read_text(encoding="utf-8")
    metrics = read_metrics(SHIPPED / METRICS)
    assert verdict(metrics) in text and "No human being was ever recorded" in text
    assert set(AIMS) <= set(metrics)
