"""From sound to motion, and to the cup in the box: a voice in the room gives the command.

Time is simulated; what reading takes of a computer's time, `vla-deploy bench speech` measures.
"""

from pathlib import Path

import pytest

from drivers.audio.espeak import EspeakEngine
from drivers.clock import NS_PER_S
from sim_twin.harness.lockstep_stack import LockstepStack
from sim_twin.sound.talker import Talker
from vla_deploy import speech

MODEL = Path(speech.__path__[0]).parent / "models" / "commands-whisper"
pytestmark = pytest.mark.skipif(not MODEL.exists(), reason="no embedded recogniser is here")
TURNING_RAD_S = 0.06


def end_of(twin: LockstepStack, timeout_s: float) -> bool:
    """Run until the newest spoken command has ended; return whether it succeeded."""
    events = twin.space.ring_reader("task_event", from_start=True)
    ends: list[bool] = []

    def has_ended() -> bool:
        told = [event.payload for event in events.drain()]
        ends.extend(
            bool(one.get("success")) for one in told if one["event"] in ("finished", "rejected")
        )
        return bool(ends)

    assert twin.lockstep.run_until(has_ended, timeout_s)
    return ends[-1]


@pytest.mark.twin(speech=True)
def test_a_spoken_command_moves_the_robot_soon_after_its_last_word(twin: LockstepStack) -> None:
    base = twin.space.cell_reader("base_state")

    def turns() -> bool:
        sample = base.latest()
        return sample is not None and abs(sample.data["w_rad_s"]) > TURNING_RAD_S

    before_rad = twin.lockstep.truth()["robot"]["yaw_rad"]
    talker = Talker(engine=EspeakEngine(voice="en-gb-x-rp+m3"))
    spoken = twin.speak("turn left twenty degrees", talker)
    assert twin.lockstep.run_until(turns, 6.0)
    assert (twin.lockstep.twin.now_ns - spoken.ends_ns) / NS_PER_S < 1.5
    assert end_of(twin, 10.0)
    turned_rad = twin.lockstep.truth()["robot"]["yaw_rad"] - before_rad
    assert turned_rad == pytest.approx(0.349, abs=0.05)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.gl
@pytest.mark.twin(speech=True)
def test_the_main_job_is_done_at_a_word(twin: LockstepStack) -> None:
    talker = Talker(engine=EspeakEngine(voice="en-gb-x-rp+m3"))
    twin.speak("pick up the red cup and put it in the box", talker)
    assert end_of(twin, 240.0)
    assert twin.lockstep.inside("red_cup", "box")["inside"]
