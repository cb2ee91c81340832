"""Turn what speaks for a reading into one figure from 0 to 1."""

import math
from typing import Final

from vla_deploy.inference.manifest import Calibration
from vla_deploy.speech.recogniser import Reading

UNCALIBRATED: Final = Calibration(bias=3.0, log_probability=4.0, no_speech=-2.0, compression=-3.0)
"""For weights that nobody has measured: a mean log-probability of -0.75 is about half sure."""
_PLAIN_COMPRESSION: Final = 2.0


def confidence(reading: Reading, calibration: Calibration | None) -> float:
    """Return how probably the words of a reading are right; 0 where it has none."""
    if not reading.text:
        return 0.0
    weights = calibration or UNCALIBRATED
    evidence = (
        weights.bias
        + weights.log_probability * reading.log_probability
        + weights.no_speech * reading.no_speech
        + weights.compression * max(0.0, reading.compression - _PLAIN_COMPRESSION)
    )
    return 1.0 / (1.0 + math.exp(-min(max(evidence, -50.0), 50.0)))
