"""Import faster-whisper, here and nowhere else, with every way to the network closed first.

It loads the hub's client, which would look for what a model's folder lacks. Threads of its
arithmetic that wait for work give their core away.
"""

import logging
import os

os.environ["ORT_DISABLE_TELEMETRY"] = "1"
os.environ["HF_HUB_OFFLINE"] = "1"
os.environ["HF_HUB_DISABLE_TELEMETRY"] = "1"
os.environ["OMP_WAIT_POLICY"] = "PASSIVE"
os.environ["KMP_BLOCKTIME"] = "0"

import ctranslate2
import faster_whisper
import numpy as np
from numpy.typing import NDArray

# It tells the log of every phrase; what was heard is told in `heard`, and nowhere else.
logging.getLogger("faster_whisper").setLevel(logging.WARNING)
MODEL_ERRORS: tuple[type[Exception], ...] = (RuntimeError, ValueError, OSError, KeyError, TypeError)
VERSION: str = f"faster-whisper {faster_whisper.__version__}"
_MARGIN_FRAMES = 40
_FRAMES_PER_STATE = 2


class TrimmedWhisper(faster_whisper.WhisperModel):  # type: ignore[misc,no-any-unimported,unused-ignore]
    """Give the encoder only the sound that is there, and a little silence.

    For weights that were trained so: the library itself always pads to its window.
    """

    content_frames: int = 0

    def encode(self, features: NDArray[np.float32]) -> ctranslate2.StorageView:
        """Return what the encoder makes of features, (mel bands, frames)."""
        kept = self.content_frames + _MARGIN_FRAMES
        kept += kept % _FRAMES_PER_STATE
        # CTranslate2 takes what has as many rows as there are mel bands for features, and would
        # encode its own states once more (`WhisperEncoder::is_encoded`).
        if kept // _FRAMES_PER_STATE == features.shape[-2]:
            kept += _FRAMES_PER_STATE
        return super().encode(np.ascontiguousarray(features[..., :kept]))


Whisper = faster_whisper.WhisperModel


def cuda_devices() -> int:
    """Return how many GPUs this build of CTranslate2 can use."""
    return int(ctranslate2.get_cuda_device_count())
