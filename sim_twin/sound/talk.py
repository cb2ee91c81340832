"""Speak to a running twin's robot: `python -m sim_twin.sound.talk --run-dir D "go to the kitchen"`.

The words are made and brought through the room here; the twin only lays them into its room.
"""

import argparse
import json
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from drivers.audio.base import AudioFormat, Samples
from drivers.audio.espeak import EspeakEngine
from drivers.audio.wav import WavOutput, read_wav
from drivers.errors import VoiceError
from sim_twin.errors import TwinError
from sim_twin.referee import ask
from sim_twin.sound.acoustics import Acoustics
from sim_twin.sound.talker import USUAL_DISTANCE_M, Talker, arrival

_MOUTH_HEIGHT_M: Final = 1.5
_EXAMPLE: Final = """example:
  python -m sim_twin.sound.talk --run-dir /run/vla --voice en-us+f4 --snr 10 "go to the kitchen"
"""


def talk(
    run_dir: Path,
    text: str,
    voice: str,
    *,
    snr_db: float | None = None,
    distance_m: float | None = None,
    place_m: tuple[float, float] | None = None,
) -> dict[str, Any]:
    """Let somebody speak in the twin's room; return when the words begin and end, host's time.

    Raises:
        TwinUnreachable: no twin answers there.
        RefereeRefusal: the robot has no microphone.
        VoiceError: the words do not become sound.
    """
    ear = ask(run_dir, "sound_ear")
    if distance_m is None:
        distance_m = _distance_m(ear["position_m"], place_m)
    talker = Talker(engine=EspeakEngine(voice=voice), distance_m=distance_m)
    heard = arrival(text, talker, ear["rate_hz"], Acoustics(), snr_db=snr_db, seed=int(ear["seed"]))
    path = run_dir / "dev" / f"talk-{os.getpid()}.wav"
    file = WavOutput(path, AudioFormat(rate_hz=ear["rate_hz"]))
    file.write(heard.sound.samples(file.format, 1.0))
    file.close()
    try:
        return ask(run_dir, "sound_play", name=path.name, words=list(heard.words))
    finally:
        path.unlink()


def said(run_dir: Path) -> Samples:
    """Return what the robot's speaker has played since the last call, (n, channels).

    Raises:
        TwinUnreachable: no twin answers there.
        RefereeRefusal: the robot has no speaker.
    """
    path = run_dir / "dev" / f"said-{os.getpid()}.wav"
    ask(run_dir, "sound_said", name=path.name)
    _, samples = read_wav(path)
    path.unlink()
    return samples


def main(argv: Sequence[str] | None = None) -> int:
    """Speak, and print as JSON when the words begin and end; 2 when that cannot be."""
    given = _parser().parse_args(argv)
    try:
        answer = talk(
            given.run_dir,
            given.text,
            given.voice,
            snr_db=given.snr,
            distance_m=given.distance,
            place_m=given.at,
        )
    except (TwinError, VoiceError) as error:
        sys.stderr.write(f"talk: {error}\n")
        return 2
    sys.stdout.write(json.dumps(answer) + "\n")
    return 0


def _distance_m(ear_m: Sequence[float], place_m: tuple[float, float] | None) -> float:
    if place_m is None:
        return USUAL_DISTANCE_M
    return math.dist(ear_m, (*place_m, _MOUTH_HEIGHT_M))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m sim_twin.sound.talk",
        description="Speak to the robot of a running twin, through the air of its room.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("text", help="what is said")
    parser.add_argument("--run-dir", type=Path, required=True)
    parser.add_argument("--voice", default="en-gb", help="of eSpeak NG (default: en-gb)")
    parser.add_argument("--snr", type=float, metavar="DB", help="over noise, this much louder")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--distance", type=float, metavar="M", help="from the robot (default: 1.5)")
    where.add_argument("--at", type=_place, metavar="X,Y", help="where the person stands, map, m")
    return parser


def _place(word: str) -> tuple[float, float]:
    x_m, y_m = (float(part) for part in word.split(","))
    return x_m, y_m


if __name__ == "__main__":
    sys.exit(main())
