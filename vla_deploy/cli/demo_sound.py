"""Give the demo's command by a synthetic voice in the twin's room, and take the times."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.cli.aloud import DOUBTED, REJECTED, STATUS_AGE_S, Aloud, Hearing, why_deaf
from vla_deploy.cli.session import Session

MOST_TIMES_SAID: Final = 3
LISTENS_WITHIN_S: Final = 10.0
_MOVING_M_S: Final = 0.01
_MOVING_RAD_S: Final = 0.06  # a servo's speed has steps of 0.024
Event = dict[str, Any]


class MotionWatch:
    """Remember when the robot first moved, as far as it was looked at."""

    def __init__(self, session: Session) -> None:
        self.first_ns: int | None = None
        self._session = session

    def look(self) -> None:
        """Note whether it moves now."""
        if self.first_ns is not None:
            return
        moving_ns = [*self._base_ns(), *self._joints_ns()]
        self.first_ns = min(moving_ns, default=None)

    def forget(self) -> None:
        """Begin anew."""
        self.first_ns = None

    def _base_ns(self) -> Iterator[int]:
        base = self._session.fresh("base_state", age_limit_s=1.0)
        if base is not None and (
            abs(base.data["v_m_s"]) > _MOVING_M_S or abs(base.data["w_rad_s"]) > _MOVING_RAD_S
        ):
            yield base.stamp_ns

    def _joints_ns(self) -> Iterator[int]:
        joints = self._session.fresh("joint_state", age_limit_s=1.0)
        if joints is None:
            return
        count = int(joints.data["joint_count"])
        if np.abs(joints.data["velocity"][:count]).max(initial=0.0) > _MOVING_RAD_S:
            yield joints.stamp_ns


class SpokenCommand:
    """Say one command, again where the robot asks for it, and tell how long everything took."""

    def __init__(self, session: Session, motion: MotionWatch) -> None:
        """Begin to listen to what the robot tells.

        Raises:
            UsageError: it is deaf.
        """
        self._session = session
        self._motion = motion
        self._aloud = Aloud(session)
        self._voice = ""
        self._times_said = 0
        self._hearing: Hearing | None = None
        self._planned_ns: int | None = None
        self._stamped = session.events("task_event")

    def events(self, text: str, voice: str, snr_db: float | None) -> Iterator[Event]:
        """Speak, and return what was heard and the task events, up to and including the last one.

        Where the robot does not understand, it is told again, as a person would.

        Raises:
            UsageError: what was heard is no command.
            CommandFailed: nobody heard it, or nobody answers.
        """
        self._voice = voice
        while True:
            hearing = self._say(text, snr_db)
            yield {"event": "heard", "text": hearing.line()}
            if hearing.told["verdict"] in (REJECTED, DOUBTED) and self._may_say_again:
                continue
            is_refused = False
            for event in self._aloud.follow(hearing):
                self._note(event)
                is_refused = event["event"] == REJECTED
                yield event
            if not (is_refused and self._may_say_again):
                return

    @property
    def _may_say_again(self) -> bool:
        return self._times_said < MOST_TIMES_SAID

    def _say(self, text: str, snr_db: float | None) -> Hearing:
        """Speak, once the robot has said what it had to say."""
        end_ns = self._session.clock.now_ns() + round(LISTENS_WITHIN_S * NS_PER_S)
        while self._times_said and is_speaking(self._session):
            self._session.pause(0.1)
            if self._session.clock.now_ns() > end_ns:
                break
        self._times_said += 1
        self._motion.forget()
        self._hearing = self._aloud.speak(text, self._voice, snr_db)
        return self._hearing

    def _note(self, event: Event) -> None:
        if event["event"] == "plan":
            plans = [one for one in self._stamped.drain() if one.payload["event"] == "plan"]
            self._planned_ns = plans[-1].stamp_ns if plans else self._session.clock.now_ns()

    def document(self) -> dict[str, Any]:
        """Return what was said and heard, and the times from the end of the words, in s."""
        hearing = self._hearing
        if hearing is None:
            return {}
        return {
            "voice": self._voice,
            "times_said": self._times_said,
            "heard": hearing.told["text"],
            "confidence": hearing.told["confidence"],
            "end_to_text_s": round(hearing.end_to_text_s, 3),
            "end_to_plan_s": self._since_words_s(self._planned_ns),
            "end_to_motion_s": self._since_words_s(self._motion.first_ns),
        }

    def _since_words_s(self, at_ns: int | None) -> float | None:
        if at_ns is None or self._hearing is None:
            return None
        return round((at_ns - self._hearing.words_ended_ns) / NS_PER_S, 3)


def is_speaking(session: Session) -> bool:
    """Tell whether the robot says something."""
    status = session.document("speech_status", age_limit_s=STATUS_AGE_S)
    return status is not None and bool(status["speaking"] or status["voice"].get("waiting"))


def await_ears(session: Session) -> str:
    """Wait until the robot listens; return why it does not, or ""."""
    end_ns = session.clock.now_ns() + round(LISTENS_WITHIN_S * NS_PER_S)
    while (why := why_deaf(session)) and session.clock.now_ns() < end_ns:
        session.pause(0.1)
    return why
