"""Type what is heard, said, and how both go."""

from typing import Literal, NotRequired, TypedDict, final

from vla_deploy.ipc.payloads.tasks import OtherWords

VoiceEventName = Literal["began", "finished", "interrupted", "failed", "dropped"]


class HeardMessage(TypedDict):
    """Say what was understood of a phrase and what becomes of it; docs/speech.md.

    A stop word of the stream has no `others`.
    """

    text: str
    verdict: Literal["accepted", "doubted", "rejected", "stop"]
    reason: str
    began_ns: int
    ended_ns: int
    told_ns: int
    confidence: float
    others: NotRequired[list[OtherWords]]


@final
class SayOrder(TypedDict):
    """Have a text said after what waits to be."""

    say_id: str
    text: str
    source: str


@final
class SayCancel(TypedDict):
    """Take back something to be said, or break it off."""

    say_id: str
    cancel: Literal[True]


SayMessage = SayOrder | SayCancel


class VoiceEvent(TypedDict):
    """Say what became of something to be said."""

    say_id: str
    event: VoiceEventName
    reason: str


class PhraseCounts(TypedDict):
    """Count phrases by verdict; times are from the end of speech to its words."""

    accepted: int
    doubted: int
    rejected: int
    stop: int
    end_to_text_p50_s: float
    end_to_text_p95_s: float


class VoiceStatus(TypedDict, total=False):
    """Say whether the robot can speak; `waiting` are texts. Empty where it has no voice."""

    state: Literal["missing", "away", "ready"]
    why: str
    waiting: int


class StopWordsStatus(TypedDict):
    """Say whether a listener hears stop words."""

    state: str
    why: str
    sensitivity: str


class SpeechStatus(TypedDict):
    """Say whether the robot hears and speaks and why not; `heard` counts phrases."""

    state: Literal["listening", "hearing", "transcribing", "deaf"]
    why: str
    speaking: bool
    model: dict[str, str]
    heard: PhraseCounts
    voice: VoiceStatus
    stop_words: NotRequired[StopWordsStatus]
    page_stop_words: NotRequired[StopWordsStatus]
