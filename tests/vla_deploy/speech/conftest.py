from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.audio.base import Samples
from drivers.clock import NS_PER_S
from platforms import SpeechSettings
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.node import NodeContext
from vla_deploy.speech.sound import Playing, SoundBlock


class Listener:
    """Keep what a stop-word spotter would be fed."""

    name = "stop_words"

    def __init__(self) -> None:
        self.blocks: list[SoundBlock] = []
        self.closed = 0
        self.refusal = ""

    def start(self, space: SharedSpace) -> None:
        self.space = space

    def feed(self, block: SoundBlock, playing: Playing | None = None) -> None:
        self.blocks.append(block)

    def refuses(self, began_ns: int, ended_ns: int) -> str:
        return self.refusal

    def adopt(self, settings: SpeechSettings) -> None:
        self.settings = settings

    def document(self) -> Mapping[str, Any]:
        return {"blocks": len(self.blocks)}

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def listener() -> Listener:
    return Listener()


def sine(seconds: float, hz: float = 440.0, rate_hz: int = 16_000, level: float = 0.25) -> Samples:
    rows = np.arange(round(seconds * rate_hz))
    wave = level * 32_767 * np.sin(2 * np.pi * hz * rows / rate_hz)
    return np.rint(wave).astype(np.int16)[:, None]


@pytest.fixture
def tone() -> Callable[..., Samples]:
    """Make a sine of so many seconds, one channel."""
    return sine


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock(NS_PER_S)


@pytest.fixture
def context(tmp_path: Path, clock: ManualClock) -> NodeContext:
    return NodeContext(
        run_dir=tmp_path, robot="butler", profile="desktop", devices_dir=None, clock=clock
    )
