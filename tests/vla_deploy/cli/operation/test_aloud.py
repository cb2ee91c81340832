"""`say --aloud` and the demo's times: the twin and the robot at the other end are the test's."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.operation.aloud import Aloud, MotionWatch, SpokenCommand, why_deaf
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import SharedSpace

ORDER = "go to the kitchen"
LISTENING = {
    "state": "listening",
    "why": "",
    "model": {"name": "commands-whisper"},
    "speaking": False,
    "voice": {},
}


class Twin:
    """Answer as the twin's sound desk does, and let the robot hear what was played."""

    def __init__(self, run_dir: Path) -> None:
        self.clock = MonotonicClock()
        self.space = SharedSpace(run_dir / "ipc", self.clock)
        self.verdicts: list[str] = ["accepted"]
        self.played: list[dict[str, Any]] = []
        self.ended_ns = 0

    def answer(self, asked: dict[str, Any]) -> dict[str, Any]:
        return {"ok": True} | (self._ear() if asked["op"] == "sound_ear" else self._play(asked))

    def _ear(self) -> dict[str, Any]:
        return {"position_m": [0.0, 0.0, 1.2], "rate_hz": 16_000, "seed": 0}

    def _play(self, asked: dict[str, Any]) -> dict[str, Any]:
        self.played.append(asked)
        self.ended_ns = self.clock.now_ns()
        self._hear(self.verdicts.pop(0))
        return {"began_ns": self.ended_ns - NS_PER_S, "ended_ns": self.ended_ns}

    def _hear(self, verdict: str) -> None:
        if verdict == "accepted":
            self.space.ring_writer("utterance").publish(
                {"command_id": "voice-1", "text": ORDER, "source": "voice"}
            )
        self.space.ring_writer("heard").publish(
            {
                "text": ORDER,
                "confidence": 0.9,
                "verdict": verdict,
                "reason": "" if verdict == "accepted" else "I am not sure",
                "began_ns": self.ended_ns - NS_PER_S,
                "ended_ns": self.ended_ns,
                "told_ns": self.ended_ns + NS_PER_S // 5,
            }
        )


@pytest.fixture
def session(tmp_path: Path) -> Iterator[RobotSession]:
    made = RobotSession(tmp_path)
    yield made
    made.close()


@pytest.fixture
def twin(tmp_path: Path, session: RobotSession, serve_twin: Callable[..., Any]) -> Iterator[Twin]:
    made = Twin(tmp_path)
    made.space.cell_writer("speech_status").put_document(LISTENING)
    serve_twin(tmp_path, made.answer)
    yield made
    made.space.close()


def tell(twin: Twin, event: str, **details: Any) -> None:
    message = {"command_id": "voice-1", "event": event} | details
    twin.space.ring_writer("task_event").publish(message)


def test_what_is_said_in_the_room_is_heard_and_followed_by_its_command(
    twin: Twin, session: RobotSession
) -> None:
    aloud = Aloud(session)
    hearing = aloud.speak(ORDER, "en-us", 10.0)
    assert hearing.command_id == "voice-1"
    assert hearing.end_to_text_s == pytest.approx(0.2)
    assert hearing.line() == f'heard: "{ORDER}" (confidence 0.90, 0.20 s after)'
    tell(twin, "finished", success=True, error=None, actions=[])
    (last,) = aloud.follow(hearing)
    assert last["success"]
    (played,) = twin.played
    assert 0 < played["words"][0] < played["words"][1]


def test_a_command_that_was_not_understood_is_said_again_and_the_times_are_of_the_last(
    twin: Twin, session: RobotSession
) -> None:
    twin.verdicts = ["rejected", "accepted", "accepted"]
    motion = MotionWatch(session)
    spoken = SpokenCommand(session, motion)
    events = spoken.events(ORDER, "en-gb", None)
    assert [next(events)["event"] for _ in range(2)] == ["heard", "heard"]
    tell(twin, "rejected", reason="put what?")
    assert [next(events)["event"] for _ in range(2)] == ["rejected", "heard"]
    motion.look()
    twin.space.cell_writer("base_state").put(
        x_m=0, y_m=0, yaw_rad=0, v_m_s=0.2, w_rad_s=0.0, enabled=1
    )
    motion.look()
    tell(twin, "plan", plan={"actions": []})
    tell(twin, "finished", success=True, error=None, actions=[])
    assert [event["event"] for event in events] == ["plan", "finished"]
    told = spoken.document()
    assert (told["times_said"], told["heard"], told["end_to_text_s"]) == (3, ORDER, 0.2)
    assert 0.0 < told["end_to_motion_s"] <= told["end_to_plan_s"] < 60.0


def test_words_that_are_no_command_are_followed_nowhere(twin: Twin, session: RobotSession) -> None:
    twin.verdicts = ["rejected"]
    aloud = Aloud(session)
    with pytest.raises(UsageError, match="asks for a repetition: I am not sure"):
        aloud.follow(aloud.speak(ORDER))


def test_a_voice_that_nobody_has_is_one_line(twin: Twin, session: RobotSession) -> None:
    with pytest.raises(CommandFailed, match="voice does not exist"):
        Aloud(session).speak(ORDER, "klingon-orc")


def test_a_real_robot_is_spoken_to_by_people(session: RobotSession) -> None:
    with pytest.raises(UsageError, match="this run has a real robot: speak to it"):
        Aloud(session)
    assert why_deaf(session) == "no speech process runs"


@pytest.mark.parametrize(
    ("status", "why"),
    [
        ({"state": "deaf", "why": "no microphone"}, "no microphone"),
        ({"state": "listening", "why": "", "model": {}}, "no model that reads words"),
    ],
)
def test_a_deaf_robot_says_why(
    twin: Twin, session: RobotSession, status: dict[str, Any], why: str
) -> None:
    assert why_deaf(session) == ""
    twin.space.cell_writer("speech_status").put_document(status)
    with pytest.raises(UsageError, match=why):
        Aloud(session)
