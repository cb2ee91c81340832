"""Speak to the twin's robot by a synthetic voice, and measure how long its reactions take."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final, Literal, TypedDict

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.session import RobotSession
from vla_deploy.cli.twin import answer_of, has_twin
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.speech import HeardMessage
from vla_deploy.ipc.payloads.tasks import TaskEvent

DEFAULT_VOICE: Final = "en-gb"
STOP: Final = "stop"
_REJECTED: Final = "rejected"
_DOUBTED: Final = "doubted"
_HEARD_WITHIN_S: Final = 5.0
_LISTENS_WITHIN_S: Final = 10.0
_STATUS_AGE_S: Final = 2.0
_MAX_TIMES_SAID: Final = 3
_MOVING_M_S: Final = 0.01
_MOVING_RAD_S: Final = 0.06  # a servo's speed has steps of 0.024


class HeardLine(TypedDict):
    """Show among a command's events what was heard."""

    event: Literal["heard"]
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Hearing:
    """Hold what the robot understood of words that ended at `words_ended_ns`.

    `heard` is the event of the topic `heard`; `command_id` is empty where it was no command.
    """

    words_ended_ns: int
    heard: HeardMessage
    command_id: str

    @property
    def end_to_text_s(self) -> float:
        """Return the time from the end of the words to their text."""
        return float(self.heard["told_ns"] - self.words_ended_ns) / NS_PER_S

    def line(self) -> str:
        """Return a line for a person."""
        confidence = f"confidence {self.heard['confidence']:.2f}"
        return f'heard: "{self.heard["text"]}" ({confidence}, {self.end_to_text_s:.2f} s after)'


class Aloud:
    """Speak to the robot of a session, and follow the command that it understands."""

    def __init__(self, session: RobotSession) -> None:
        """Subscribe to what the robot hears.

        Raises:
            UsageError: it has no twin, or it understands no speech.
        """
        if not has_twin(session.run_dir):
            raise UsageError(
                "--aloud lets a synthetic person speak in the twin's room, and this run has a real "
                "robot: speak to it, or give the command without --aloud"
            )
        why = why_deaf(session)
        if why:
            raise UsageError(f"the robot hears nothing: {why}; give the command without --aloud")
        self._session = session
        self._heard = session.events(topics.HEARD)
        self._utterances = session.events(topics.UTTERANCE)
        self._events = session.events(topics.TASK_EVENT)
        self._commands: dict[str, str] = {}

    def speak(self, text: str, voice: str = DEFAULT_VOICE, snr_db: float | None = None) -> Hearing:
        """Speak, and return the first result of the robot's speech recognition.

        Raises:
            CommandFailed: the words do not become sound, or the robot hears nothing of them.
        """
        words = ["--run-dir", str(self._session.run_dir), "--voice", voice]
        words += [] if snr_db is None else ["--snr", str(snr_db)]
        spoken = answer_of(self._session, "sim_twin.sound.talk", *words, "--", text)
        ended_ns = int(spoken["ended_ns"])
        heard = self._first_heard(int(spoken["began_ns"]), ended_ns)
        return Hearing(
            words_ended_ns=ended_ns,
            heard=heard,
            command_id=self._commands.get(heard["text"], ""),
        )

    def follow(
        self, hearing: Hearing, pause: Callable[[], None] | None = None
    ) -> Iterator[TaskEvent]:
        """Return the task events of the command, up to and including the last one.

        Raises:
            UsageError: what was heard is no command.
            CommandFailed: planner and executor do not answer; raised by the iterator.
        """
        verdict = hearing.heard["verdict"]
        if verdict == _REJECTED:
            raise UsageError(f"the robot asks for a repetition: {hearing.heard['reason']}")
        if not hearing.command_id:
            raise UsageError(f"what was heard is no command: {verdict}")
        return self._session.follow(hearing.command_id, self._events, pause)

    def _first_heard(self, began_ns: int, ended_ns: int) -> HeardMessage:
        while self._session.clock.now_ns() < ended_ns + _HEARD_WITHIN_S * NS_PER_S:
            heard = [event.payload for event in self._heard.drain()]
            for event in self._utterances.drain():
                if event.payload["source"] == "voice":
                    self._commands[event.payload["text"]] = event.payload["command_id"]
            for one in heard:
                if one["ended_ns"] > began_ns:
                    return one
            self._session.pause()
        raise CommandFailed(
            f"nobody heard the words within {_HEARD_WITHIN_S:g} s; see: vla-deploy status"
        )


def why_deaf(session: RobotSession) -> str:
    """Return why the robot understands no speech; empty when it listens."""
    status = session.document(topics.SPEECH_STATUS, age_limit_s=_STATUS_AGE_S)
    if status is None:
        return "no speech process runs"
    if status["state"] == "deaf":
        return str(status["why"] or "it does not say why")
    return "" if status.get("model") else "it has no model that reads words"


def wait_until_listening(session: RobotSession) -> str:
    """Wait until the robot listens; return why it does not, or ""."""
    listens = session.wait_for(lambda: not why_deaf(session) or None, _LISTENS_WITHIN_S, 0.1)
    return "" if listens else why_deaf(session)


class MotionWatch:
    """Remember when the robot was first seen to move."""

    def __init__(self, session: RobotSession) -> None:
        self.first_ns: int | None = None
        self._session = session

    def look(self) -> None:
        """Check whether it moves now, unless it has moved already."""
        if self.first_ns is None:
            self.first_ns = min((*self._base_ns(), *self._joints_ns()), default=None)

    def _base_ns(self) -> Iterator[int]:
        base = self._session.fresh(topics.BASE_STATE, age_limit_s=1.0)
        if base is not None and (
            abs(base.data["v_m_s"]) > _MOVING_M_S or abs(base.data["w_rad_s"]) > _MOVING_RAD_S
        ):
            yield base.stamp_ns

    def _joints_ns(self) -> Iterator[int]:
        joints = self._session.fresh(topics.JOINT_STATE, age_limit_s=1.0)
        if joints is None:
            return
        count = int(joints.data["joint_count"])
        if np.abs(joints.data["velocity"][:count]).max(initial=0.0) > _MOVING_RAD_S:
            yield joints.stamp_ns


class SpokenCommand:
    """Speak one command, repeat it where the robot asks for that, and take the times."""

    def __init__(self, session: RobotSession, motion: MotionWatch) -> None:
        """Subscribe to what the robot hears and plans.

        Raises:
            UsageError: it understands no speech.
        """
        self._session = session
        self._motion = motion
        self._aloud = Aloud(session)
        self._voice = ""
        self._times_said = 0
        self._hearing: Hearing | None = None
        self._planned_ns: int | None = None
        self._stamped = session.events(topics.TASK_EVENT)

    def events(
        self, text: str, voice: str, snr_db: float | None
    ) -> Iterator[TaskEvent | HeardLine]:
        """Speak, and yield what was heard and the task events, up to and including the last one.

        Raises:
            UsageError: what was heard is no command.
            CommandFailed: the words were not heard, or planner and executor do not answer.
        """
        self._voice = voice
        while True:
            hearing = self._say(text, snr_db)
            yield {"event": "heard", "text": hearing.line()}
            if hearing.heard["verdict"] in (_REJECTED, _DOUBTED) and self._may_repeat:
                continue
            is_refused = False
            for event in self._aloud.follow(hearing):
                self._note(event)
                is_refused = event["event"] == _REJECTED
                yield event
            if not (is_refused and self._may_repeat):
                return

    @property
    def _may_repeat(self) -> bool:
        return self._times_said < _MAX_TIMES_SAID

    def _say(self, text: str, snr_db: float | None) -> Hearing:
        """Speak, once the robot has finished speaking."""
        if self._times_said:
            session = self._session
            session.wait_for(lambda: not is_speaking(session) or None, _LISTENS_WITHIN_S, 0.1)
        self._times_said += 1
        self._motion.first_ns = None
        self._hearing = self._aloud.speak(text, self._voice, snr_db)
        return self._hearing

    def _note(self, event: TaskEvent) -> None:
        if event["event"] == "plan":
            plans = [one for one in self._stamped.drain() if one.payload["event"] == "plan"]
            self._planned_ns = plans[-1].stamp_ns if plans else self._session.clock.now_ns()

    def document(self) -> dict[str, Any]:
        """Return what was said and heard, and the times from the end of the words, in s."""
        hearing = self._hearing
        if hearing is None:
            return {}

        def since_words_s(at_ns: int | None) -> float | None:
            return None if at_ns is None else round((at_ns - hearing.words_ended_ns) / NS_PER_S, 3)

        return {
            "voice": self._voice,
            "times_said": self._times_said,
            "heard": hearing.heard["text"],
            "confidence": hearing.heard["confidence"],
            "end_to_text_s": round(hearing.end_to_text_s, 3),
            "end_to_plan_s": since_words_s(self._planned_ns),
            "end_to_motion_s": since_words_s(self._motion.first_ns),
        }


def is_speaking(session: RobotSession) -> bool:
    """Return whether the robot speaks."""
    status = session.document(topics.SPEECH_STATUS, age_limit_s=_STATUS_AGE_S)
    return status is not None and bool(status["speaking"] or status["voice"].get("waiting"))
