"""Speak the drawn sentences: shards of clips, each from its number alone."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from training.speech.sentences import draw_sentence
from training.voices.cast import draw_speaker, draw_style, say
from training.voices.clip import Clip
from training.voices.clip_store import write_shard

CLIPS_PER_SHARD: Final = 1000
_LOG = logging.getLogger(__name__)


def generate(folder: Path, shards: int, seed: int, clips: int = CLIPS_PER_SHARD) -> None:
    """Write the shards that are missing.

    Raises:
        EngineMissing: eSpeak NG or flite is not installed.
    """
    for number in range(shards):
        write_shard(folder / f"{number:04d}", _clips(number, seed, clips))
        _LOG.info("shard %d of %d", number + 1, shards)


def _clips(number: int, seed: int, count: int) -> Iterator[Clip]:
    random = np.random.default_rng([seed, number])
    for _ in range(count):
        yield say(draw_sentence(random), draw_speaker(random), draw_style(random))
