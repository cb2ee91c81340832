"""Declare what else lives in the speech process: listeners to the raw stream, and the voice."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from platforms import SpeechSettings
from vla_deploy.ipc import SharedSpace
from vla_deploy.speech.sound import SoundBlock


@dataclass(frozen=True, slots=True, kw_only=True)
class Playing:
    """Describe what sounds from the speaker at a moment.

    The robot knows its own words by `text` when it hears them; `level_db` is how loud the speaker
    is: RMS of what it plays against full scale. `echo_db` is how loud the microphone may hear it at
    this moment, after its echo was taken out; None where the voice cannot tell.
    """

    say_id: str
    text: str
    level_db: float
    echo_db: float | None = None


class StreamListener(Protocol):
    """Hear every block, before anything is cut or judged, also while the robot speaks.

    `feed` runs within the node's step and takes a small part of it: what takes longer goes beside.
    """

    name: str

    def start(self, space: SharedSpace) -> None:
        """Open topics and models."""
        ...

    def feed(self, block: SoundBlock, *, is_read: bool) -> None:
        """Take the next block; one that does not follow the last one begins anew.

        `is_read` tells that the recogniser reads what is said in it.
        """
        ...

    def refuses(self, began_ns: int, ended_ns: int) -> str:
        """Return why a phrase of that time is no command; empty where it may be one."""
        ...

    def suspicion(self, began_ns: int, ended_ns: int) -> float:
        """Return how near to being heard what it listens for came then; 1 is heard."""
        ...

    def heed(self, settings: SpeechSettings) -> None:
        """Go by the settings of another profile from now on."""
        ...

    def document(self) -> Mapping[str, Any]:
        """Return what `speech_status` tells under the listener's name; small, as JSON takes it."""
        ...

    def close(self) -> None:
        """Release everything; closing twice is allowed."""
        ...


class Voice(Protocol):
    """Speak, a little in each step of the node."""

    @property
    def playing(self) -> Playing | None:
        """Return what sounds from the speaker at this moment; None while it is silent."""
        ...

    def start(self, space: SharedSpace) -> None:
        """Open topics; a speaker that is not there is a status, no error."""
        ...

    def step(self) -> None:
        """Take what is to be said, and hand the speaker what it has room for."""
        ...

    def cleaned(self, block: SoundBlock) -> SoundBlock | None:
        """Return a block without what the robot says itself; None while it waits for the next."""
        ...

    def barge_in(self, stamp_ns: int) -> None:
        """Fall silent: a person has spoken into what the robot says, from `stamp_ns` on."""
        ...

    def document(self) -> Mapping[str, Any]:
        """Return what `speech_status` tells under "voice"; small, as JSON takes it."""
        ...

    def close(self) -> None:
        """Release everything; closing twice is allowed."""
        ...
