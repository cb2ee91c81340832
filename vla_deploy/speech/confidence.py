"""Turn what speaks for a reading into one figure from 0 to 1."""

import math
from dataclasses import astuple
from typing import Final

from vla_deploy.inference.manifest import Calibration
from vla_deploy.speech.reading import Reading

UNCALIBRATED: Final = Calibration(bias=3.0, log_probability=4.0, no_speech=-2.0, compression=-3.0)
"""For weights that nobody has measured: a mean log-probability of -0.75 is about half sure."""
_PLAIN_COMPRESSION: Final = 2.0


def evidence_of(reading: Reading) -> tuple[float, float, float, float]:
    """Return what a calibration's weights are for, in their order."""
    repeats = max(0.0, reading.compression - _PLAIN_COMPRESSION)
    return 1.0, reading.log_probability, reading.no_speech, repeats


def confidence(reading: Reading, calibration: Calibration | None) -> float:
    """Return how probably the words of a reading are right; 0 where it has none."""
    if not reading.text:
        return 0.0
    weights = astuple(calibration or UNCALIBRATED)
    evidence = sum(
        weight * value for weight, value in zip(weights, evidence_of(reading), strict=True)
    )
    return 1.0 / (1.0 + math.exp(-min(max(evidence, -50.0), 50.0)))
