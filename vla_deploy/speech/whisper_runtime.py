"""Import faster-whisper, here and nowhere else, with every way to the network closed first.

It loads the hub's client, which would look for what a model's folder lacks. Threads of its
arithmetic that wait for work give their core away.
"""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

os.environ["ORT_DISABLE_TELEMETRY"] = "1"
os.environ["HF_HUB_OFFLINE"] = "1"
os.environ["HF_HUB_DISABLE_TELEMETRY"] = "1"
os.environ["OMP_WAIT_POLICY"] = "PASSIVE"
os.environ["KMP_BLOCKTIME"] = "0"

import ctranslate2
import faster_whisper
import numpy as np
from faster_whisper.audio import pad_or_trim
from faster_whisper.tokenizer import Tokenizer
from faster_whisper.transcribe import get_compression_ratio, get_suppressed_tokens
from numpy.typing import NDArray

from vla_deploy.speech.sound import RATE_HZ, Sound
from vla_deploy.speech.transcript import Transcript, others_of

VERSION: str = f"faster-whisper {faster_whisper.__version__}"
_TOKENS_S: Final = 12.0
_TOKENS: Final = 8
_MOST_TOKENS: Final = 200
_MARGIN_FRAMES: Final = 40
_FRAMES_PER_STATE: Final = 2
_PLAIN_SUPPRESSED: Final = [-1]  # those that a model's own files name


class WhisperRuntime:
    """Read phrases of one window of sound, and keep what else the search found.

    With `trimmed` weights the encoder is given the sound's own frames and a little silence only;
    others know but windows of 30 s.
    """

    def __init__(self, folder: Path, *, trimmed: bool, **options: Any) -> None:
        whisper = faster_whisper.WhisperModel(str(folder), local_files_only=True, **options)
        self.model = whisper.model
        self.feature_extractor = whisper.feature_extractor
        self._tokenizer = whisper.hf_tokenizer
        self._trimmed = trimmed

    def read(self, samples: Sound, *, languages: Sequence[str], beam: int) -> Transcript:
        """Return what is said, in the one language of `languages` or in the one that is found."""
        window = self._window(samples)
        states = self.model.encode(ctranslate2.StorageView.from_array(window), to_cpu=False)
        language = self._language(states, languages)
        multilingual = self.model.is_multilingual
        words = Tokenizer(self._tokenizer, multilingual, task="transcribe", language=language)
        prompt = [*words.sot_sequence, words.no_timestamps]
        # CTranslate2 ends a text at half of what it is told.
        longest = 2 * (_TOKENS + math.ceil(_TOKENS_S * len(samples) / RATE_HZ))
        found = self.model.generate(
            states,
            [prompt],
            beam_size=beam,
            num_hypotheses=beam,
            max_length=len(prompt) + min(_MOST_TOKENS, longest),
            return_scores=True,
            return_no_speech_prob=True,
            suppress_tokens=get_suppressed_tokens(words, _PLAIN_SUPPRESSED),
        )[0]
        readings = [
            (words.decode(tokens).strip(), score * len(tokens))
            for tokens, score in zip(found.sequences_ids, found.scores, strict=True)
        ]
        text, log_probability = readings[0]
        return Transcript(
            text=text,
            # The end of the text is a token, too.
            log_probability=log_probability / (len(found.sequences_ids[0]) + 1),
            no_speech=found.no_speech_prob,
            compression=get_compression_ratio(text),
            language=language,
            others=others_of(readings),
            is_foreign=self.model.is_multilingual and language not in languages,
        )

    def _window(self, samples: Sound) -> NDArray[np.float32]:
        """Return the features that the encoder is given, (1, mel bands, frames)."""
        features = pad_or_trim(self.feature_extractor(samples)[:, :-1])
        if not self._trimmed:
            return np.ascontiguousarray(features[None])
        kept = len(samples) // self.feature_extractor.hop_length + _MARGIN_FRAMES
        kept += kept % _FRAMES_PER_STATE
        # CTranslate2 takes what has as many rows as there are mel bands for features, and would
        # encode its own states once more (`WhisperEncoder::is_encoded`).
        if kept // _FRAMES_PER_STATE == features.shape[-2]:
            kept += _FRAMES_PER_STATE
        return np.ascontiguousarray(features[None, :, :kept])

    def _language(self, states: ctranslate2.StorageView, languages: Sequence[str]) -> str:
        if not self.model.is_multilingual:
            return "en"
        if len(languages) == 1:
            return languages[0]
        token: str = self.model.detect_language(states)[0][0][0]
        return token[2:-2]


def cuda_devices() -> int:
    """Return how many GPUs this build of CTranslate2 can use."""
    return int(ctranslate2.get_cuda_device_count())
