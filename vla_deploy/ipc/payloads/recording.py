"""Type what recorder and replay are asked and what they report."""

from collections.abc import Sequence
from typing import Literal, NotRequired, TypedDict

RecordingStateName = Literal["off", "beginning", "recording", "paused", "failed", "ended"]
ReplayAct = Literal["pause", "resume", "seek", "speed"]


class FlightRequest(TypedDict):
    """Ask for what the flight recorder holds."""

    source: str
    reason: str


class FlightSaved(TypedDict):
    """A flight is in a file."""

    event: Literal["saved"]
    causes: list[str]
    file: str


class FlightFailed(TypedDict):
    """A flight could not be saved."""

    event: Literal["failed"]
    causes: list[str]
    reason: str


FlightEvent = FlightSaved | FlightFailed


class RecorderStatus(TypedDict):
    """Say how much the flight recorder holds and whether it writes."""

    writing: bool
    held_bytes: int


class RecordingStart(TypedDict):
    """Begin a recording of topics by pattern; one without duration goes on until it is stopped."""

    act: Literal["start"]
    topics: Sequence[str]
    without: Sequence[str]
    duration_s: float | None
    label: str
    source: str


class RecordingStop(TypedDict):
    """End the recording."""

    act: Literal["stop"]
    source: str


RecordingMessage = RecordingStart | RecordingStop


class RecordingProgress(TypedDict):
    """Say how a recording goes; `lost` counts values that are in no file."""

    state: RecordingStateName
    why: str
    file: str
    file_bytes: int
    files: int
    messages: int
    lost: int
    backlog_bytes: int


class NoRecording(TypedDict):
    """Nothing was recorded yet."""


class RecordingOff(TypedDict):
    """Nothing is recorded; `refused` is why the last request was, `last` how a recording ended."""

    state: Literal["off"]
    refused: str
    last: RecordingProgress | NoRecording


class RecordingOn(RecordingProgress):
    """Say also what is recorded for whom, and for how much longer."""

    label: str
    source: str
    topics: str
    without: str
    left_s: float | None
    refused: str
    last: RecordingProgress | NoRecording


RecordingStatus = RecordingOff | RecordingOn


class ReplayRequest(TypedDict):
    """Control a replay; `value` is a moment in s after the beginning, or a speed as a factor."""

    act: ReplayAct
    value: NotRequired[float]


class ReplayStatus(TypedDict):
    """Say where a replay stands; `unfit` counts messages that do not fit their topics."""

    file: str
    kind: str
    robot: str
    run_id: str
    state: Literal["paused", "ended", "playing"]
    position_s: float
    duration_s: float
    began_s: float
    speed: float
    loop: bool
    unfit: int
    refused: str
