"""`vla-deploy hear`: show what is understood of a recording, or of live speech."""

import argparse
import dataclasses
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.audio.open_audio import open_audio_input
from drivers.clock import NS_PER_S, Clock, MonotonicClock
from platforms import Profile, load_profile
from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.session import base_of
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.robots import load_robot
from vla_deploy.robots.links import device_links
from vla_deploy.speech.asr_pipeline import AsrPipeline, HeardPhrase
from vla_deploy.speech.errors import SpeechError
from vla_deploy.speech.event_publisher import evidence
from vla_deploy.speech.microphone import Microphone, linked
from vla_deploy.speech.model_selection import select_recogniser
from vla_deploy.speech.recording import StreamClock, frames_of, open_hearing, sound_of
from vla_deploy.speech.sound import Sound, count_of
from vla_deploy.supervisor.profiles.profile_choice import start_profile

_STEP_NS: Final = NS_PER_S // 50
_AFTER_S: Final = 1.5


def register(commands: Any) -> None:
    """Add the command."""
    hear = add_top_command(
        commands,
        "hear",
        "  vla-deploy hear command.wav --json\n"
        "  vla-deploy hear --microphone --seconds 20\n"
        "  vla-deploy hear command.wav --model whisper-small.en\n",
        run,
        json_help="print JSON, live a line for each phrase",
    )
    source = hear.add_mutually_exclusive_group(required=True)
    source.add_argument("file", type=Path, nargs="?", metavar="FILE.wav", help="a recording")
    source.add_argument("--microphone", action="store_true", help="the robot's own, live")
    hear.add_argument("--robot", default="butler", help="whose microphone (default: butler)")
    hear.add_argument("--model", help="recogniser (default: as the profile says)")
    hear.add_argument("--profile", help="name or path (default: the one of the next start)")
    hear.add_argument("--seconds", type=float, help="how long to listen (default: until Ctrl-C)")


def run(arguments: argparse.Namespace) -> int:
    """Print each phrase with its verdict; no robot is needed, and none gets it as a command."""
    profile = _profile(arguments)
    shelf = ModelShelf.of_base(base_of(arguments), MonotonicClock())
    selected = select_recogniser(shelf, profile, 0)
    if selected.recogniser is None:
        raise SpeechError(selected.why)
    if selected.why:
        print(f"vla-deploy: degraded: {selected.why}", file=sys.stderr)
    clock = StreamClock()
    live: Clock = MonotonicClock()
    used = live if arguments.microphone else clock
    hearing = open_hearing(selected, profile, used)
    try:
        if arguments.microphone:
            return _listen(arguments, hearing, live)
        return _read(arguments, list(_heard(hearing, clock, sound_of(arguments.file))))
    finally:
        hearing.close()


def _profile(arguments: argparse.Namespace) -> Profile:
    profile = load_profile(arguments.profile or start_profile(arguments.runtime_base).name)
    if arguments.model is None:
        return profile
    choice = profile.models["speech_to_text"]
    only = dataclasses.replace(choice, tiers=(arguments.model,))
    return dataclasses.replace(profile, models={**profile.models, "speech_to_text": only})


def _read(arguments: argparse.Namespace, phrases: list[HeardPhrase]) -> int:
    text = "\n".join(map(_line, phrases)) or f"{arguments.file}: nobody speaks"
    return emit(arguments, [_document(heard) for heard in phrases], text)


def _heard(hearing: AsrPipeline, clock: StreamClock, sound: Sound) -> Iterator[HeardPhrase]:
    """Yield phrases of a recording; silence is appended so that the last one ends."""
    for frame in frames_of(np.pad(sound, (0, count_of(_AFTER_S)))):
        clock.ns = frame.end_ns
        hearing.feed(frame, None)
        yield from hearing.heard()


def _listen(arguments: argparse.Namespace, hearing: AsrPipeline, clock: Clock) -> int:
    """Print phrases of the microphone until the time is over, or Ctrl-C."""
    robot = load_robot(arguments.robot)
    opened = linked(robot.microphone, open_audio_input, device_links(robot), clock)
    if opened is None:
        raise UsageError(f"robot {robot.name} has no [microphone]; hear a FILE.wav instead")
    microphone = Microphone(opened, clock)
    began_ns = clock.now_ns()
    deadline_ns = began_ns + round((arguments.seconds or 1e9) * NS_PER_S)
    try:
        for heard in _live(microphone, hearing, clock, deadline_ns):
            document = json.dumps(_document(heard, began_ns))
            print(document if arguments.json else _line(heard, began_ns), flush=True)
    finally:
        microphone.close()
    return 0


def _live(
    microphone: Microphone, hearing: AsrPipeline, clock: Clock, deadline_ns: int
) -> Iterator[HeardPhrase]:
    """Yield phrases as they end.

    Raises:
        CommandFailed: the microphone is not there.
    """
    while clock.now_ns() < deadline_ns:
        for frame in microphone.poll():
            hearing.feed(frame, None)
            yield from hearing.heard()
        if microphone.away:
            raise CommandFailed(microphone.away)
        clock.sleep_until(clock.now_ns() + _STEP_NS)


def _line(heard: HeardPhrase, since_ns: int = 0) -> str:
    began_s, ended_s = (
        (one - since_ns) / NS_PER_S for one in (heard.phrase.began_ns, heard.phrase.ended_ns)
    )
    reason = f" ({heard.judgement.reason})" if heard.judgement.reason else ""
    return (
        f"{began_s:7.2f} to {ended_s:.2f} s  {heard.judgement.verdict:<8} "
        f"{heard.confidence:>4.0%}  {heard.text!r}{reason}"
    )


def _document(heard: HeardPhrase, since_ns: int = 0) -> dict[str, Any]:
    """Return a phrase for JSON, its times in seconds since `since_ns`."""
    return {
        "began_s": round((heard.phrase.began_ns - since_ns) / NS_PER_S, 3),
        "ended_s": round((heard.phrase.ended_ns - since_ns) / NS_PER_S, 3),
        "text": heard.text,
        "verdict": str(heard.judgement.verdict),
        "reason": heard.judgement.reason,
        **evidence(heard),
    }
