from pathlib import Path

import numpy as np
import pytest

from training.voices.clip import Sound, SpokenClip
from training.voices.clip_store import read_shard, shards, write_shard


def _clip(text: str, count: int) -> SpokenClip:
    return SpokenClip(
        text=text,
        engine="espeak",
        voice="en",
        samples=np.linspace(-1.0, 1.0, count, dtype=np.float32),
        sounds=(Sound(phone="k", began_s=0.25),),
    )


def test_clips_come_back_as_they_were_stored(tmp_path: Path) -> None:
    write_shard(tmp_path / "0000", [_clip("one", 300), _clip("two", 5)])
    [folder] = shards(tmp_path)
    first, second = read_shard(folder)
    assert (first.text, second.text, len(second.samples)) == ("one", "two", 5)
    assert first.sounds == (Sound(phone="k", began_s=0.25),)
    assert first.samples == pytest.approx(_clip("one", 300).samples, abs=1e-4)


def test_a_shard_that_was_broken_off_is_not_read_and_is_written_anew(tmp_path: Path) -> None:
    def broken() -> "list[SpokenClip]":
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_shard(tmp_path / "0000", (clip for _ in range(1) for clip in broken()))
    assert list(shards(tmp_path)) == []
    write_shard(tmp_path / "0000", [_clip("one", 300)])
    assert [clip.text for clip in read_shard(tmp_path / "0000")] == ["one"]
