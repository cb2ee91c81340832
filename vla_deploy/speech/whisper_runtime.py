"""Import faster-whisper, here and nowhere else, with every way to the network closed first.

It loads the hub's client, which would look for what a model's folder lacks. Threads of its
arithmetic that wait for work give their core away.
"""

import logging
import os
from typing import Any

os.environ["ORT_DISABLE_TELEMETRY"] = "1"
os.environ["HF_HUB_OFFLINE"] = "1"
os.environ["HF_HUB_DISABLE_TELEMETRY"] = "1"
os.environ["OMP_WAIT_POLICY"] = "PASSIVE"
os.environ["KMP_BLOCKTIME"] = "0"

import ctranslate2
import faster_whisper
import numpy as np
from faster_whisper.transcribe import get_compression_ratio
from numpy.typing import NDArray

# It tells the log of every phrase; what was heard is told in `heard`, and nowhere else.
logging.getLogger("faster_whisper").setLevel(logging.WARNING)
VERSION: str = f"faster-whisper {faster_whisper.__version__}"
_MARGIN_FRAMES = 40
_FRAMES_PER_STATE = 2


class Whisper(faster_whisper.WhisperModel):  # type: ignore[misc,no-any-unimported,unused-ignore]
    """Keep what else the search found beside what it read, which the library drops.

    `hypotheses` are those of each window of sound: texts with the logarithm of their probability,
    the best first. Whoever reads empties them before. With `content_frames` the encoder is given
    only so many frames and a little silence, for weights that were trained so: the library itself
    always pads to its window.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.hypotheses: list[list[tuple[str, float]]] = []
        self.content_frames: int | None = None

    def encode(self, features: NDArray[np.float32]) -> ctranslate2.StorageView:
        """Return what the encoder makes of features, (mel bands, frames)."""
        if self.content_frames is None:
            return super().encode(features)
        kept = self.content_frames + _MARGIN_FRAMES
        kept += kept % _FRAMES_PER_STATE
        # CTranslate2 takes what has as many rows as there are mel bands for features, and would
        # encode its own states once more (`WhisperEncoder::is_encoded`).
        if kept // _FRAMES_PER_STATE == features.shape[-2]:
            kept += _FRAMES_PER_STATE
        return super().encode(np.ascontiguousarray(features[..., :kept]))

    def generate_with_fallback(
        self, encoder_output: ctranslate2.StorageView, prompt: list[int], tokenizer: Any, how: Any
    ) -> tuple[Any, float, float, float]:
        """Return the best text, its mean log-probability, the temperature, how much it repeats.

        The library would try again at other temperatures; here there is none but nought.
        """
        # The library takes the same bounds from its options.
        longest = how.max_new_tokens
        result = self.model.generate(
            encoder_output,
            [prompt],
            beam_size=how.beam_size,
            num_hypotheses=how.beam_size,
            patience=how.patience,
            length_penalty=how.length_penalty,
            repetition_penalty=how.repetition_penalty,
            no_repeat_ngram_size=how.no_repeat_ngram_size,
            max_length=self.max_length if longest is None else len(prompt) + longest,
            return_scores=True,
            return_no_speech_prob=True,
            suppress_blank=how.suppress_blank,
            suppress_tokens=how.suppress_tokens,
            max_initial_timestamp_index=round(how.max_initial_timestamp / self.time_precision),
        )[0]
        found = [
            (tokenizer.decode(tokens).strip(), score * len(tokens) ** how.length_penalty)
            for tokens, score in zip(result.sequences_ids, result.scores, strict=True)
        ]
        self.hypotheses.append(found)
        text, log_probability = found[0]
        # The end of the text is a token, too.
        mean = log_probability / (len(result.sequences_ids[0]) + 1)
        return result, mean, 0.0, get_compression_ratio(text)


def cuda_devices() -> int:
    """Return how many GPUs this build of CTranslate2 can use."""
    return int(ctranslate2.get_cuda_device_count())
