from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drivers.audio.base import Samples
from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.runtime.node import NodeContext


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
