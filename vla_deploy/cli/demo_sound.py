"""Give the demo's command by a synthetic voice in the twin's room, and take the times."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S
from vla_deploy.cli.aloud import REJECTED, Aloud, Hearing, why_deaf
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

    def say(self, text: str, voice: str, snr_db: float | None) -> Hearing:
        """Speak until something was heard that the robot does not ask to be repeated.

        Raises:
            CommandFailed: nobody heard it.
        """
        self._voice = voice
        while True:
            self._times_said += 1
            self._motion.forget()
            self._hearing = hearing = self._aloud.speak(text, voice, snr_db)
            if hearing.told["verdict"] != REJECTED or self._times_said == MOST_TIMES_SAID:
                return hearing

    def events(self, hearing: Hearing) -> Iterator[Event]:
        """Return the task events of what was heard, up to and including the last one.

        Raises:
            UsageError: what was heard is no command.
            CommandFailed: nobody answers; raised by the iterator.
        """
        for event in self._aloud.follow(hearing):
            if event["event"] == "plan":
                self._planned_ns = self._session.clock.now_ns()
            yield event

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


def await_ears(session: Session) -> str:
    """Wait until the robot listens; return why it does not, or ""."""
    end_ns = session.clock.now_ns() + round(LISTENS_WITHIN_S * NS_PER_S)
    while (why := why_deaf(session)) and session.clock.now_ns() < end_ns:
        session.pause(0.1)
    return why
