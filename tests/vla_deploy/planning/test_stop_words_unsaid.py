"""No sentence of the robot's own holds a stop word: it would take a person's for its own."""

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest

import vla_deploy
from vla_deploy.planning.dialogue.phrasing import first_part, spoken_refusal, steps_in_words
from vla_deploy.planning.errors import NotUnderstood
from vla_deploy.speech.words import STOPS

PACKAGE: Final = Path(vla_deploy.__file__).parent
SPEAKERS: Final = (
    "planning", "plans", "memory", "world", "skills/actions", "speech/event_publisher.py",
)  # fmt: skip
"""Where sentences stand that are said aloud."""
NOT_SAID: Final = frozenset(
    {
        "planning/patterns/steering.py",  # what a person may say
        "planning/patterns/phrase.py",
        "planning/patterns/table.py",
        "planning/command_parser/certainty.py",
        "planning/errors.py",  # to be read: `spoken_refusal` says it in other words
    }
)
STOP_WORD: Final = re.compile(rf"(?<![a-z])(?:{'|'.join(STOPS)})(?![a-z])", re.IGNORECASE)


def modules() -> list[str]:
    """Return every module that may put words into the robot's mouth."""
    found = [
        file
        for name in SPEAKERS
        for file in ([PACKAGE / name] if name.endswith(".py") else (PACKAGE / name).rglob("*.py"))
    ]
    return sorted(str(file.relative_to(PACKAGE)) for file in found)


def sentences(module: str) -> Iterator[str]:
    """Yield the texts of a module that are more than a word: no names of skills, no docstrings."""
    tree = ast.parse((PACKAGE / module).read_text(encoding="utf-8"))
    notes = {id(one.value) for one in ast.walk(tree) if isinstance(one, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value.strip()
            if " " in text and id(node) not in notes:
                yield text


def test_the_words_are_those_that_the_shipped_model_hears() -> None:
    manifest = tomllib.loads((PACKAGE / "models/stop_words/model.toml").read_text(encoding="utf-8"))
    assert frozenset(manifest["key_words"]["words"]) == STOPS


def test_sentences_are_found() -> None:
    said = [text for module in modules() for text in sentences(module)]
    for known in ("All right, I leave it.", "I look around.", "say it again"):
        assert any(known in text for text in said), known


def test_no_fixed_sentence_holds_a_stop_word() -> None:
    said = [(module, text) for module in modules() for text in sentences(module)]
    wrong = [(module, text) for module, text in said if STOP_WORD.search(text)]
    assert [one for one in wrong if one[0] not in NOT_SAID] == []


def test_a_plan_that_stops_is_read_back_without_the_word(propose: Any) -> None:
    steps = steps_in_words(propose(("navigate_to", {"place": "kitchen"}), ("stop", {})).plan, {})
    assert steps == "go to the kitchen and stand still"


@pytest.mark.parametrize("word", sorted(STOPS))
def test_a_reason_is_told_without_a_stop_word(word: str) -> None:
    reason = f"the emergency {word} is latched: reset, then arm"
    assert first_part(reason) == "the emergency standstill is latched: reset, then arm"
    assert first_part("stopped by a person; halted") == "stopped by a person"
    assert not STOP_WORD.search(spoken_refusal(NotUnderstood("dance")))
