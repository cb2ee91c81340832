"""The speech process hears through its companions, and says why it cannot, whatever is missing."""

import sys
from collections.abc import Callable, Mapping
from typing import Any

import pytest

from drivers.audio.base import AudioFormat, AudioInput, Samples
from drivers.audio.pushed import PushedInput
from drivers.clock import NS_PER_S
from drivers.errors import DeviceMissing
from platforms import load_profile
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.ipc import SharedSpace
from vla_deploy.node import NodeContext
from vla_deploy.robots import load_robot
from vla_deploy.speech.node import SpeechNode
from vla_deploy.speech.sound import SoundBlock


class Listener:
    """Keep what a stop-word spotter would be fed."""

    name = "stop_words"

    def __init__(self) -> None:
        self.blocks: list[SoundBlock] = []
        self.closed = 0

    def start(self, space: SharedSpace) -> None:
        self.space = space

    def feed(self, block: SoundBlock) -> None:
        self.blocks.append(block)

    def document(self) -> Mapping[str, Any]:
        return {"blocks": len(self.blocks)}

    def close(self) -> None:
        self.closed += 1


class Bench:
    """Step a node whose microphone is pushed, plugged in or not."""

    def __init__(self, context: NodeContext, clock: ManualClock, format_: AudioFormat) -> None:
        self.clock = clock
        self.format = format_
        self.plugged = True
        self.device: PushedInput | None = None
        self.listener = Listener()
        self.node = SpeechNode(
            context,
            load_robot("butler"),
            load_profile("desktop"),
            self.open,
            listeners=[self.listener],
        )
        self.node.start()
        self._status = SharedSpace(context.run_dir / "ipc", clock).cell_reader("speech_status")

    def open(self) -> AudioInput:
        if not self.plugged:
            raise DeviceMissing("sound device 'ReSpeaker': not there; plug it in")
        self.device = PushedInput(self.format, self.clock)
        return self.device

    def plug(self) -> None:
        self.plugged, self.device = True, None

    def play(self, samples: Samples) -> None:
        """Let a microphone hear samples as time passes, a step every 20 ms."""
        size = self.format.rate_hz // 50
        for at in range(0, len(samples), size):
            self.clock.ns += NS_PER_S // 50
            if self.device is not None and self.plugged:
                self.device.push(samples[at : at + size])
            self.node.step()

    def status(self) -> dict[str, Any]:
        sample = self._status.latest()
        assert sample is not None
        return sample.document()


MakeBench = Callable[..., Bench]


@pytest.fixture
def bench(context: NodeContext, clock: ManualClock) -> Any:
    made: list[Bench] = []

    def make(rate_hz: int = 16_000) -> Bench:
        made.append(Bench(context, clock, AudioFormat(rate_hz=rate_hz)))
        return made[0]

    yield make
    made[0].node.stop()
    assert made[0].listener.closed == 1


def test_a_listener_hears_every_block_in_time_at_16_khz(bench: MakeBench, tone: Any) -> None:
    rig = bench(rate_hz=48_000)
    rig.node.step()
    rig.play(tone(1.0, rate_hz=48_000))
    blocks = rig.listener.blocks
    assert sum(len(block.samples) for block in blocks) == pytest.approx(16_000, abs=50)
    assert [block.follows for block in blocks] == [False] + 49 * [True]
    assert blocks[-1].end_ns == pytest.approx(rig.clock.ns, abs=5_000_000)
    assert rig.status()["state"] == "listening"
    assert rig.status()["stop_words"]["blocks"] > 0


def test_a_microphone_that_is_unplugged_is_told_and_heard_again_when_it_is_back(
    bench: MakeBench, tone: Any
) -> None:
    rig = bench()
    rig.plugged = False
    rig.play(tone(0.5))
    assert (rig.status()["state"], rig.listener.blocks) == ("deaf", [])
    assert "plug it in" in rig.status()["why"]
    rig.plug()
    rig.play(tone(5.0))
    assert rig.status()["state"] == "listening"
    heard = len(rig.listener.blocks)
    rig.plugged = False
    rig.play(tone(4.0))
    assert rig.status()["state"] == "deaf"
    rig.plug()
    rig.play(tone(5.0))
    assert rig.status()["state"] == "listening"
    assert not rig.listener.blocks[heard].follows


def test_a_robot_without_a_microphone_says_so_and_runs(context: NodeContext) -> None:
    node = SpeechNode(context, load_robot("butler"), load_profile("desktop"), None)
    node.start()
    node.step()
    status = SharedSpace(context.run_dir / "ipc", context.clock).cell_reader("speech_status")
    told = status.latest()
    assert told is not None
    assert told.document()["why"] == "robot butler has no [microphone]"
    node.stop()


def test_a_missing_extra_is_told_in_words(
    bench: MakeBench, tone: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    rig = bench(rate_hz=48_000)
    rig.play(tone(1.0, rate_hz=48_000))
    assert rig.status()["state"] == "deaf"
    assert "pip install 'vla-deploy[speech]'" in rig.status()["why"]
