import numpy as np

from training.speech.calibration import fit
from training.speech.judging import Read
from training.voices.clip import SpokenClip
from vla_deploy.speech.transcript import Transcript, confidence


def _read(text: str, log_probability: float) -> Read:
    clip = SpokenClip(text="red cup", engine="none", voice="", samples=np.zeros(1, np.float32))
    reading = Transcript(
        text=text,
        log_probability=log_probability,
        no_speech=0.0,
        compression=0.5,
        language="en",
    )
    return Read(clip=clip, reading=reading, cpu_s=0.01)


def test_confidence_learns_at_which_log_probability_half_of_the_readings_are_right() -> None:
    random = np.random.default_rng(0)
    draws = random.uniform(-2.0, 0.0, 400)
    right = random.random(400) < 1.0 / (1.0 + np.exp(-8.0 * (draws + 0.6)))
    reads = [
        _read("red cup" if good else "bread cap", float(x))
        for good, x in zip(right, draws, strict=True)
    ]
    weights = fit(reads)
    half, sure, unsure = (confidence(_read("x", x).reading, weights) for x in (-0.6, -0.1, -1.5))
    assert abs(half - 0.5) < 0.15 and sure > 0.9 and unsure < 0.1
