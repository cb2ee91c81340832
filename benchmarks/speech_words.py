"""Measure the shipped recogniser: word errors, sureness, what it makes of other sound, its time.

Sentences and the names of the voices lie in `training/speech/held_out` and `training/voices`; they
are spoken on the spot by eSpeak NG, flite and festival. `missing` says which engine is not
installed: its figures are None then. All is read as on the robot.
"""

import sys
from collections.abc import Sequence
from contextlib import closing
from typing import Any, Final

from benchmarks.command import parser, show
from drivers.clock import MonotonicClock
from platforms import load_profile
from training.speech.judging import other_sounds, speed, sureness, word_errors
from vla_deploy.inference.manifest_schema import SPEECH_TO_TEXT
from vla_deploy.inference.roles import ModelShelf, choice_for
from vla_deploy.runtime.state_dir import user_base
from vla_deploy.speech.recogniser import Recogniser, open_recogniser

MODEL: Final = "commands-whisper"
_OTHER_SOUNDS: Final = 66


def measure(sentences: int = 150, seed: int = 0, profile: str = "desktop") -> dict[str, Any]:
    """Return the figures.

    Raises:
        InferenceError: the model cannot be opened.
        EngineMissing: eSpeak NG or flite is not installed.
    """
    recogniser, least = open_shipped(profile)
    with closing(recogniser):
        figures, reads = word_errors(recogniser, sentences, seed)
        return {
            "model": MODEL,
            **figures,
            "wer_10db": figures["wer_held_out_voices_10db"],
            **speed(reads),
            **sureness(recogniser, reads, least),
            **other_sounds(recogniser, least, _OTHER_SOUNDS, seed),
            "memory_mb": recogniser.memory_mb,
        }


def open_shipped(profile: str) -> tuple[Recogniser, float]:
    """Open the shipped recogniser under a profile; return the confidence that it asks for, too.

    Raises:
        InferenceError: it cannot be opened.
    """
    clock, loaded = MonotonicClock(), load_profile(profile)
    model = ModelShelf.of_base(user_base(), clock).store.load(MODEL)
    choice, beam = choice_for(SPEECH_TO_TEXT, loaded), loaded.speech.beam
    opened = open_recogniser(model, choice, beam=beam, clock=clock)
    return opened, loaded.speech.least_confidence


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("speech --part words", __doc__)
    arguments.add_argument("--sentences", type=int, default=150)
    arguments.add_argument("--seed", type=int, default=0)
    given = arguments.parse_args(argv)
    show(measure(given.sentences, given.seed), as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
