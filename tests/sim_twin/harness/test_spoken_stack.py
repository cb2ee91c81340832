"""The whole robot in lock-step with microphone and speaker."""

import numpy as np
import pytest

from sim_twin.contracts.payloads import payload_faults
from sim_twin.harness.lockstep_stack import LockstepStack

SPOKEN = {
    *("control_status", "executor_status", "operator", "plan", "planner_status", "say"),
    *("speech_status", "task_event", "utterance", "voice_event"),
}


@pytest.mark.twin(speech=True)
def test_the_robot_speaks_in_its_room_and_ignores_its_own_voice(twin: LockstepStack) -> None:
    heard = twin.space.ring_reader("heard", from_start=True)
    outcome = twin.say("say stop the music, please")
    (action,) = outcome["actions"]
    assert (action["status"], action["note"]) == ("succeeded", None)
    said = twin.said()
    assert len(said) / 16_000 == pytest.approx(action["execution_time_s"], abs=0.5)
    assert np.abs(said).max() > 3_000
    twin.lockstep.run_for(1.5)
    assert heard.drain() == []
    assert not twin.status()["estop_latched"]
    found = payload_faults(twin.space)
    assert not any(found.values()), found
    assert found.keys() >= SPOKEN


@pytest.mark.twin(speech=True)
def test_a_talker_is_recognised_as_one_phrase(twin: LockstepStack) -> None:
    heard = twin.space.ring_reader("heard", from_start=True)
    spoken = twin.speak("go to the kitchen", snr_db=20.0)
    twin.lockstep.run_for(4.0)
    phrases = [event.payload for event in heard.drain()]
    assert len(phrases) == 1
    assert payload_faults(twin.space)["heard"] == []
    assert phrases[0]["began_ns"] == pytest.approx(spoken.begins_ns, abs=300_000_000)
    assert phrases[0]["ended_ns"] == pytest.approx(spoken.ends_ns, abs=300_000_000)
