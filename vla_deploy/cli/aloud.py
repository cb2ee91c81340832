"""Let a synthetic person speak in the twin's room, and follow what the robot makes of it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.referee import answer_of
from vla_deploy.cli.session import Session
from vla_deploy.cli.twin_link import has_twin

USUAL_VOICE: Final = "en-gb"
PATIENCE_S: Final = 5.0
"""For so long after the words somebody must have heard them."""
STATUS_AGE_S: Final = 2.0
STOP: Final = "stop"
REJECTED: Final = "rejected"
DOUBTED: Final = "doubted"
_SOURCE: Final = "voice"
Event = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Hearing:
    """Hold what the robot made of words that ended at `words_ended_ns`.

    `told` is the event of the topic `heard`; `command_id` is empty where no command came of it.
    """

    words_ended_ns: int
    told: Event
    command_id: str

    @property
    def end_to_text_s(self) -> float:
        """Return the time from the end of the words to their text."""
        return float(self.told["told_ns"] - self.words_ended_ns) / NS_PER_S

    def line(self) -> str:
        """Return it in words."""
        confidence = f"confidence {self.told['confidence']:.2f}"
        return f'heard: "{self.told["text"]}" ({confidence}, {self.end_to_text_s:.2f} s after)'


class Aloud:
    """Speak to the robot of a session, once."""

    def __init__(self, session: Session) -> None:
        """Begin to listen to what the robot tells.

        Raises:
            UsageError: it has no twin, or it is deaf.
        """
        if not has_twin(session.run_dir):
            raise UsageError(
                "--aloud lets a synthetic person speak in the twin's room, and this run has a real "
                "robot: speak to it, or give the command without --aloud"
            )
        why = why_deaf(session)
        if why:
            raise UsageError(f"the robot hears nothing: {why}; give the command without --aloud")
        import_module("vla_deploy.cli.follow")  # loads pydantic: not once the robot acts
        self._session = session
        self._heard = session.events("heard")
        self._utterances = session.events("utterance")
        self._events = session.events("task_event")
        self._commands: dict[str, str] = {}

    def speak(self, text: str, voice: str = USUAL_VOICE, snr_db: float | None = None) -> Hearing:
        """Speak, and return the first that the robot has made of it.

        Raises:
            CommandFailed: the words do not become sound, or the robot hears nothing of them.
        """
        words = ["--run-dir", str(self._session.run_dir), "--voice", voice]
        words += [] if snr_db is None else ["--snr", str(snr_db)]
        spoken = answer_of(self._session, "sim_twin.sound.talk", *words, "--", text)
        ended_ns = int(spoken["ended_ns"])
        told = self._first_told(int(spoken["began_ns"]), ended_ns)
        return Hearing(
            words_ended_ns=ended_ns,
            told=told,
            command_id=self._commands.get(str(told["text"]), ""),
        )

    def follow(self, hearing: Hearing, pause: Callable[[], None] | None = None) -> Iterator[Event]:
        """Return the task events of what was heard, up to and including the last one.

        Raises:
            UsageError: what was heard is no command.
            CommandFailed: nobody answers; raised by the iterator.
        """
        verdict = hearing.told["verdict"]
        if verdict == REJECTED:
            raise UsageError(f"the robot asks for a repetition: {hearing.told['reason']}")
        if not hearing.command_id:
            raise UsageError(f"what was heard is no command: {verdict}")
        return self._session.follow(hearing.command_id, self._events, pause)

    def _first_told(self, began_ns: int, ended_ns: int) -> Event:
        while self._session.clock.now_ns() < ended_ns + PATIENCE_S * NS_PER_S:
            told = [event.payload for event in self._heard.drain()]
            self._note_commands()
            for event in told:
                if event["ended_ns"] > began_ns:
                    return event
            self._session.pause()
        raise CommandFailed(
            f"nobody heard the words within {PATIENCE_S:g} s; see: vla-deploy status"
        )

    def _note_commands(self) -> None:
        for event in self._utterances.drain():
            if event.payload.get("source") == _SOURCE:
                self._commands[str(event.payload["text"])] = str(event.payload["command_id"])


def why_deaf(session: Session) -> str:
    """Return why the robot understands no spoken words; empty when it listens."""
    status = session.document("speech_status", age_limit_s=STATUS_AGE_S)
    if status is None:
        return "no speech process runs"
    if status["state"] == "deaf":
        return str(status["why"] or "it does not say why")
    return "" if status.get("model") else "it has no model that reads words"
