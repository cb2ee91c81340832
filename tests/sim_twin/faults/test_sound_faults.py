"""Hold the sound drivers to every fault of microphone and speaker."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.audio.base import AudioFormat, Samples
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from drivers.errors import DeviceMissing, LinkLost
from sim_twin.errors import FaultRefused
from sim_twin.faults import Component, Fault
from sim_twin.faults.table import EFFECTS
from sim_twin.harness.lockstep import Lockstep

FORMAT = AudioFormat(rate_hz=16_000)
POLL_S = 0.02
POLLS = 25
HEARD_BY_THE_END = round(POLL_S * POLLS * FORMAT.rate_hz)


@pytest.fixture
def lockstep(tmp_path: Path) -> Iterator[Lockstep]:
    world = Lockstep(tmp_path=tmp_path)
    yield world
    world.close()


def tone(level: int) -> Samples:
    return np.full((8_000, 1), level, np.int16)


class Ear:
    """Listen through the driver for half a second at a time."""

    def __init__(self, lockstep: Lockstep) -> None:
        self._lockstep = lockstep
        lockstep.run_for(POLL_S)
        stream = lockstep.devices.stream("microphone")
        self.driver = PcmInput(stream, lockstep.clock, FORMAT)

    def listen(self) -> list[int]:
        """Return the samples that have come, one after the other."""
        heard: list[int] = []
        for _ in range(POLLS):
            self._lockstep.run_for(POLL_S)
            block = self.driver.poll()
            heard += [] if block is None else block.samples[:, 0].tolist()
        return heard


def hear(lockstep: Lockstep, fault: str, **details: Any) -> tuple[Ear, list[int]]:
    """Listen, then listen while the fault is on and the room is loud."""
    ear = Ear(lockstep)
    assert len(ear.listen()) == HEARD_BY_THE_END
    lockstep.faults.inject("microphone", None, fault, **details)
    lockstep.twin.microphone.play(tone(9_000))
    return ear, ear.listen()


def test_every_fault_of_sound_is_played_here() -> None:
    of_sound = (Component.MICROPHONE, Component.SPEAKER)
    assert {row for row in EFFECTS if row[0] in of_sound} == {
        *((Component.MICROPHONE, Fault(name)) for name in ("off", "stuck", "garbage", "delayed")),
        *((Component.MICROPHONE, Fault.UNPLUG), (Component.SPEAKER, Fault.UNPLUG)),
        (Component.SPEAKER, Fault.OFF),
    }


def test_a_microphone_that_is_off_gives_nothing(lockstep: Lockstep) -> None:
    ear, heard = hear(lockstep, "off", duration_s=1.0)
    assert heard == []
    lockstep.run_for(1.0)
    ear.listen()
    lockstep.twin.microphone.play(tone(5_000))
    assert max(ear.listen()) > 4_000


def test_a_stuck_microphone_delivers_nothing_twice(lockstep: Lockstep) -> None:
    ear, heard = hear(lockstep, "stuck")
    assert heard == []
    assert ear.driver.counters.repeated_blocks == POLLS


def test_garbage_is_counted_and_never_heard(lockstep: Lockstep) -> None:
    ear, heard = hear(lockstep, "garbage", seed=3)
    assert heard == []
    assert ear.driver.counters.discarded_bytes > 1_000


def test_delayed_sound_is_complete(lockstep: Lockstep) -> None:
    ear, heard = hear(lockstep, "delayed", delay_s=0.2)
    assert len(heard) == pytest.approx(HEARD_BY_THE_END - 0.2 * FORMAT.rate_hz, abs=400)
    assert ear.driver.counters.lost_samples == 0


def test_an_unplugged_microphone_is_lost_and_comes_back(lockstep: Lockstep) -> None:
    ear = Ear(lockstep)
    fault = lockstep.faults.inject("microphone", None, "unplug")
    with pytest.raises(LinkLost):
        ear.listen()
    with pytest.raises(DeviceMissing):
        Ear(lockstep)
    fault.clear()
    assert len(Ear(lockstep).listen()) == HEARD_BY_THE_END


def mouth(lockstep: Lockstep) -> PcmOutput:
    return PcmOutput(lockstep.devices.stream("speaker"), lockstep.clock, FORMAT)


def test_a_speaker_that_is_off_loses_the_sound(lockstep: Lockstep) -> None:
    speaker = mouth(lockstep)
    fault = lockstep.faults.inject("speaker", None, "off")
    assert speaker.write(tone(700)[:1_000]) == 1_000
    assert len(lockstep.twin.speaker.said()) == 0
    fault.clear()
    lockstep.run_for(0.2)
    assert speaker.write(tone(700)[:1_000]) == 1_000
    assert len(lockstep.twin.speaker.said()) == 1_000


def test_an_unplugged_speaker_is_lost_and_comes_back(lockstep: Lockstep) -> None:
    speaker = mouth(lockstep)
    fault = lockstep.faults.inject("speaker", None, "unplug")
    with pytest.raises(LinkLost):
        speaker.write(tone(700)[:10])
    fault.clear()
    assert mouth(lockstep).write(tone(700)[:10]) == 10


def test_what_a_speaker_cannot_have_is_refused_by_what_it_can(lockstep: Lockstep) -> None:
    with pytest.raises(FaultRefused, match="it supports off, unplug, intermittent"):
        lockstep.faults.inject("speaker", None, "garbage")
