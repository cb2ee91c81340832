"""Declare which keys the `[whisper]` table of a manifest has, and which files such a model has."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from vla_deploy.inference.manifest import EncoderContext
from vla_deploy.inference.parts_schema import parts_faults
from vla_deploy.robots.schema import (
    NUMBER,
    OPTIONAL_TABLE,
    RobotFileFault,
    Shape,
    ValueCheck,
    check_record,
    one_of,
)

SPEECH_TO_TEXT: Final = "speech_to_text"
NEEDED_PARTS: Final = ("model.bin", "config.json", "tokenizer.json")
VOCABULARIES: Final = ("vocabulary.json", "vocabulary.txt")
"""CTranslate2 converters of different age name it differently; one of them is there."""

_WHISPER: Shape = {
    "languages": ValueCheck(
        expected='a list of language codes such as "en", none twice',
        holds=lambda value: (
            isinstance(value, list)
            and value != []
            and all(isinstance(one, str) and one.isalpha() and one.islower() for one in value)
            and len(set(value)) == len(value)
        ),
    ),
    "context": one_of(*EncoderContext),
    # Manifests of earlier releases have it; it has no meaning any more.
    "hot_words": ValueCheck(expected="true or false", holds=lambda _: True, is_optional=True),
    "calibration": OPTIONAL_TABLE,
}
_CALIBRATION: Shape = {
    "bias": NUMBER,
    "log_probability": NUMBER,
    "no_speech": NUMBER,
    "compression": NUMBER,
}


def whisper_faults(whisper: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    """Find every key of the table that is unknown, missing or wrong."""
    yield from check_record(whisper, "whisper", _WHISPER)
    if isinstance(whisper.get("calibration"), dict):
        yield from check_record(whisper["calibration"], "whisper.calibration", _CALIBRATION)


def whisper_cross_faults(document: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    """Find what of such a manifest does not fit together."""
    yield from parts_faults(document, table="whisper", role=SPEECH_TO_TEXT, needed=NEEDED_PARTS)
    paths = [part["path"] for part in document["parts"]]
    if not any(name in paths for name in VOCABULARIES):
        yield RobotFileFault(key="parts", got=f"{paths}", expected=f"{VOCABULARIES[0]} among them")
