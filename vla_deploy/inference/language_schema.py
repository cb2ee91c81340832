"""Declare which keys the `[language]` table of a manifest has, and which files such a model has."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

from vla_deploy.inference.manifest import LanguageUse
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

PLANNER: Final = "planner"
GENAI_CONFIG: Final = "genai_config.json"
TOKENIZER: Final = "tokenizer.json"
NEEDED_PARTS: Final = (GENAI_CONFIG, TOKENIZER)

_LANGUAGE: Shape = {
    "use": one_of(*LanguageUse),
    "most_tokens": ValueCheck(
        expected="an integer above 0",
        holds=lambda value: isinstance(value, int) and not isinstance(value, bool) and value > 0,
    ),
    "certainty": OPTIONAL_TABLE,
}
_CERTAINTY: Shape = {
    "bias": NUMBER,
    "least": NUMBER,
    "mean": NUMBER,
    "strange": NUMBER,
    "read_back_below": NUMBER,
    "decline_below": NUMBER,
}


def language_faults(language: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    """Find every key of the table that is unknown, missing or wrong."""
    yield from check_record(language, "language", _LANGUAGE)
    if isinstance(language.get("certainty"), dict):
        yield from check_record(language["certainty"], "language.certainty", _CERTAINTY)


def language_cross_faults(document: Mapping[str, Any]) -> Iterator[RobotFileFault]:
    """Find what of such a manifest does not fit together."""
    yield from parts_faults(document, table="language", role=PLANNER, needed=NEEDED_PARTS)
    paths = [part["path"] for part in document["parts"]]
    if not any(path.endswith(".onnx") for path in paths):
        yield RobotFileFault(key="parts", got=f"{paths}", expected="an .onnx file among them")
