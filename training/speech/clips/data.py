"""Speak the drawn sentences: shards of clips, each from its number alone."""

import logging
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from training.speech.clips.pausing import as_read, with_pauses
from training.speech.clips.sentences import draw_sentence
from training.voices.cast import draw_of_all, draw_style, say
from training.voices.clip import SpokenClip
from training.voices.clip_store import write_shard
from training.voices.errors import SynthesisFailed

CLIPS_PER_SHARD: Final = 1000
_LOG = logging.getLogger(__name__)


def generate(folder: Path, shards: int, seed: int, clips: int = CLIPS_PER_SHARD) -> None:
    """Write the shards that are missing.

    Raises:
        EngineMissing: an engine is not installed.
    """
    for number in range(shards):
        write_shard(folder / f"{number:04d}", _clips(number, seed, clips))
        _LOG.info("shard %d of %d", number + 1, shards)


def _clips(number: int, seed: int, count: int) -> Iterator[SpokenClip]:
    random = np.random.default_rng([seed, number])
    spoken = 0
    while spoken < count:
        try:
            text = with_pauses(draw_sentence(random), random)
            said = say(text, draw_of_all(random), draw_style(random))
        except SynthesisFailed as error:
            _LOG.warning("left out: %s", error)
            continue
        spoken += 1
        yield replace(said, text=as_read(text))
