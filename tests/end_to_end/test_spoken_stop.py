"""A person in the room stops the robot by a word; noise and other talk let it go on."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.audio.espeak import EspeakEngine
from drivers.clock import NS_PER_S
from platforms import load_profile
from sim_twin.harness.audio_streams import streamed_microphone
from sim_twin.harness.lockstep_stack import LockstepControl
from sim_twin.sound.talker import Talker
from vla_deploy.speech.node import SpeechNode
from vla_deploy.speech.stop_words.listener import build_stop_words

pytestmark = pytest.mark.timeout(60)

TARGETS = {"left_shoulder_pitch": 1.2, "right_shoulder_pitch": 1.2}
STILL_RAD_S = 0.02
LATEST_S = 0.5
"""From the end of the word to the latch."""


class Moving:
    """Be a robot that listens while it moves its arms."""

    def __init__(self, folder: Path) -> None:
        self.rig = LockstepControl(folder)
        context, profile = self.rig.lockstep.context, load_profile("desktop")
        microphone = streamed_microphone(
            self.rig.robot, self.rig.lockstep.devices, self.rig.lockstep.clock
        )
        self.node = SpeechNode(
            context,
            self.rig.robot,
            profile,
            microphone,
            stop_words=build_stop_words(context, profile),
        )
        self.rig.lockstep.add(self.node)
        self.rig.arm()
        self.rig.go(TARGETS, 0.1)
        assert self.rig.lockstep.run_until(lambda: self.fastest() > 0.1, 3.0)

    def fastest(self) -> float:
        joints = self.rig.lockstep.truth()["joints"]
        return max(abs(joints[name]["velocity"]) for name in TARGETS)

    def is_latched(self) -> bool:
        return bool(self.rig.status()["estop_latched"])


@pytest.fixture
def moving(tmp_path: Path) -> Iterator[Moving]:
    made = Moving(tmp_path)
    yield made
    made.rig.close()


def test_a_spoken_stop_brings_moving_arms_to_rest(moving: Moving) -> None:
    clock = moving.rig.lockstep
    spoken = moving.rig.speak("stop", Talker(engine=EspeakEngine(voice="en-us")), snr_db=15.0)
    assert clock.run_until(moving.is_latched, 3.0)
    assert clock.now_s - spoken.ends_ns / NS_PER_S < LATEST_S
    assert clock.run_until(lambda: moving.fastest() < STILL_RAD_S, 1.0)
    assert moving.rig.status()["cause"] == "estop"
    clock.run_for(0.5)
    assert moving.fastest() < STILL_RAD_S


def test_noise_and_other_talk_stop_nothing(moving: Moving) -> None:
    clock = moving.rig.lockstep
    room = clock.twin.microphone.room
    noise = np.random.default_rng(1).normal(0.0, 0.05, 2 * room.rate_hz).astype(np.float32)
    room.lay(noise, room.row_at(clock.twin.now_ns))
    clock.run_for(1.0)
    assert moving.fastest() > STILL_RAD_S
    clock.run_for(1.0)
    spoken = moving.rig.speak("bring me the red cup from the table")
    clock.run_for((spoken.ends_ns - clock.twin.now_ns) / NS_PER_S + 1.0)
    assert not moving.is_latched()
