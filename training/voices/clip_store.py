"""Keep spoken clips on disk: shards of int16 samples with an index, each written whole or not."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from training.voices.clip import Sound, SpokenClip, Wave

_SAMPLES: Final = "samples.i16"
_INDEX: Final = "index.jsonl"
_FULL_SCALE: Final = 32_767.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredClip:
    """Hold a clip whose samples stay on disk until they are asked for."""

    text: str
    engine: str
    voice: str
    data: NDArray[np.int16]
    sounds: tuple[Sound, ...]

    @property
    def samples(self) -> Wave:
        """Return the samples as a share of full scale."""
        return self.data.astype(np.float32) / np.float32(_FULL_SCALE)


def write_shard(folder: Path, clips: Iterable[SpokenClip]) -> None:
    """Write clips as a shard; a shard that is already there is left as it is."""
    if folder.exists():
        return
    partial = folder.with_name(folder.name + ".part")
    partial.mkdir(parents=True, exist_ok=True)
    with (
        (partial / _SAMPLES).open("wb") as samples,
        (partial / _INDEX).open("w", encoding="utf-8") as index,
    ):
        for clip in clips:
            data = np.round(np.clip(clip.samples, -1.0, 1.0) * _FULL_SCALE).astype("<i2")
            samples.write(data.tobytes())
            sounds = [[one.phone, round(one.began_s, 4)] for one in clip.sounds]
            row = [clip.text, clip.engine, clip.voice, len(data), sounds]
            index.write(json.dumps(row) + "\n")
    partial.rename(folder)


def read_shard(folder: Path) -> list[StoredClip]:
    """Return the clips of a shard.

    Raises:
        FileNotFoundError: there is none.
    """
    data = np.memmap(folder / _SAMPLES, "<i2", mode="r")
    clips = []
    start = 0
    for line in (folder / _INDEX).read_text(encoding="utf-8").splitlines():
        text, engine, voice, count, sounds = json.loads(line)
        clips.append(
            StoredClip(
                text=text,
                engine=engine,
                voice=voice,
                data=data[start : start + count],
                sounds=tuple(Sound(phone=phone, began_s=began_s) for phone, began_s in sounds),
            )
        )
        start += count
    return clips


def shards(folder: Path) -> Iterator[Path]:
    """Yield the finished shards of a store in order."""
    yield from sorted(path for path in folder.glob("*") if path.is_dir() and not path.suffix)
