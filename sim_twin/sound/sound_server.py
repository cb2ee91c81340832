"""Answer over the twin's socket what concerns sound: where the robot listens, play, what it said.

Sound goes through files in the twin's own folder: a request is one short line, and whoever asks
has done the work that would hold up the physics.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drivers.audio.base import FULL_SCALE
from drivers.audio.clip import Clip
from drivers.audio.wav import WavOutput, read_wav
from drivers.errors import DriverError
from sim_twin.errors import RefereeRefusal
from sim_twin.sound.hearing import ear_position_m, let_arrive
from sim_twin.sound.talker import Arrival
from sim_twin.twin import Twin

Answer = dict[str, Any]


class SoundServer:
    """Serve one twin's room; `clock_ns` returns the run's time of a simulated one."""

    def __init__(self, twin: Twin, folder: Path, seed: int, clock_ns: Callable[[int], int]) -> None:
        self._twin = twin
        self._folder = folder
        self._seed = seed
        self._clock_ns = clock_ns
        self.operations: Mapping[str, Callable[[Mapping[str, Any]], Answer]] = {
            "sound_ear": self._ear,
            "sound_play": self._play,
            "sound_said": self._said,
        }

    def _ear(self, _request: Mapping[str, Any]) -> Answer:
        microphone = self._twin.microphone
        return {
            "position_m": ear_position_m(self._twin).tolist(),
            "rate_hz": microphone.format.rate_hz,
            "seed": self._seed,
        }

    def _play(self, request: Mapping[str, Any]) -> Answer:
        rate_hz = self._twin.microphone.format.rate_hz
        try:
            format_, samples = read_wav(self._file(request))
        except DriverError as error:
            raise RefereeRefusal(f"sound_play: {error}") from error
        if format_.rate_hz != rate_hz:
            raise RefereeRefusal(f"sound_play: expected {rate_hz} Hz, got {format_}")
        wave = (samples.mean(axis=1) / FULL_SCALE).astype(np.float32)
        words = _rows(request.get("words"), len(wave))
        sound = Clip(rate_hz=rate_hz, wave=wave)
        spoken = let_arrive(self._twin, Arrival(sound=sound, words=words))
        return {
            "began_ns": self._clock_ns(spoken.begins_ns),
            "ended_ns": self._clock_ns(spoken.ends_ns),
        }

    def _said(self, request: Mapping[str, Any]) -> Answer:
        speaker = self._twin.speaker
        samples = speaker.said()
        try:
            file = WavOutput(self._file(request), speaker.format)
        except DriverError as error:
            raise RefereeRefusal(f"sound_said: {error}") from error
        file.write(samples)
        file.close()
        return {"rows": len(samples)}

    def _file(self, request: Mapping[str, Any]) -> Path:
        name = request.get("name")
        if not isinstance(name, str) or Path(name).name != name or not name.endswith(".wav"):
            raise RefereeRefusal(f"name: expected that of a .wav beside the devices, got {name!r}")
        return self._folder / name


def _rows(words: object, count: int) -> tuple[int, int]:
    if words is None:
        return 0, count
    if isinstance(words, list) and len(words) == 2 and all(isinstance(row, int) for row in words):
        return words[0], words[1]
    raise RefereeRefusal(f"words: expected the rows [first, end], got {words!r}")
