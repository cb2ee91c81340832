"""The model that comes with the software reads plain commands, leaves other talk alone, in time."""

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from threading import Event

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.inference.errors import InferenceError, ModelFileSpoiled
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.store import EMBEDDED, ModelStore, StoredModel
from vla_deploy.planning.command_parser.certainty import Oddities
from vla_deploy.planning.command_parser.grammar import Step
from vla_deploy.planning.command_parser.rung import CommandParser, Parsed, open_command_parser
from vla_deploy.planning.command_parser.wording import plain_words
from vla_deploy.planning.errors import CannotBeDone, Declined
from vla_deploy.planning.interfaces import Forbidden, PlanRequest, Prohibition, StandingOrder
from vla_deploy.planning.planner import checked
from vla_deploy.plans.errors import PlanError
from vla_deploy.plans.knowledge import world_of
from vla_deploy.robots import load_robot
from vla_deploy.runtime.deadline import Deadline

WORLD = world_of(load_robot("butler"), {})
CLOCK = MonotonicClock()


@pytest.fixture(scope="module")
def parser() -> Iterator[CommandParser]:
    opened = open_command_parser(stored(EMBEDDED), PLAIN_CHOICE)
    yield opened
    opened.close()


def stored(folder: Path) -> StoredModel:
    return ModelStore(folder / "nobody", embedded=folder).load("command_parser")


def soon(recall: Event | None = None, within_s: float = 20.0) -> Deadline:
    return Deadline.within(CLOCK, within_s, recall)


def request(text: str, heard: float | None = None) -> PlanRequest:
    return PlanRequest(
        command_id="c", text=text, world=WORLD, here=(1.0, 2.0, 0.0), heard_confidence=heard
    )


@pytest.mark.parametrize(
    ("text", "steps"),
    [
        ("I'd like you to head over to the kitchen", [{"do": "go", "where": "kitchen"}]),
        (
            "Could you put the red cup in the box?",
            [{"do": "put", "what": "red cup", "how": "in", "where": "box"}],
        ),
        ("I need the bottle", [{"do": "bring", "what": "bottle"}]),
        (
            "would you mind fetching my phone from the bedroom",
            [{"do": "bring", "what": "phone", "from": "bedroom"}],
        ),
        (
            "please rotate 45 degrees to the left",
            [{"do": "turn", "way": "left", "by": "45 degrees"}],
        ),
        ("have you seen my keys", [{"do": "where", "what": "keys"}]),
        ("pick up the blue wug please", [{"do": "pick", "what": "blue wug"}]),
    ],
)
def test_plain_commands_are_read(
    parser: CommandParser, text: str, steps: list[dict[str, str]]
) -> None:
    assert list(parser.parse(text, soon()).steps) == steps


def reading(parser: CommandParser, monkeypatch: pytest.MonkeyPatch, *steps: Step) -> None:
    """Let the parser read these steps, as one that was trained further may."""
    oddities = Oddities()

    def parse(text: str, _: Deadline) -> Parsed:
        words = tuple(plain_words(text))
        return Parsed(words=words, steps=steps, confidence=1.0, features={}, oddities=oddities)

    monkeypatch.setattr(parser, "parse", parse)


def test_a_step_that_waits_for_a_word_holds_all_that_follows(
    parser: CommandParser, monkeypatch: pytest.MonkeyPatch
) -> None:
    go, wait = {"do": "go", "where": "kitchen"}, {"do": "await"}
    reading(parser, monkeypatch, wait, go)
    held = parser.propose(request("once I nod go to the kitchen"), soon())
    assert held.awaits_word and held.plan.summary == "navigate to the kitchen"
    assert held.covers is not None and "once" in held.covers
    reading(parser, monkeypatch, go, wait, go)
    with pytest.raises(CannotBeDone, match="only before I begin"):
        parser.propose(request("go to the kitchen and once I nod go to the kitchen"), soon())


KEYS = Prohibition(what=Forbidden.THING, words="keys")
KITCHEN = Prohibition(what=Forbidden.PLACE, words="kitchen")


@pytest.mark.parametrize(
    ("step", "order", "question"),
    [
        ({"do": "forbid", "what": "keys"}, StandingOrder(forbids=True, of=KEYS), ""),
        ({"do": "forbid", "where": "kitchen"}, StandingOrder(forbids=True, of=KITCHEN), ""),
        ({"do": "permit", "what": "keys"}, StandingOrder(forbids=False, of=KEYS),
         "May I touch the keys again?"),
        ({"do": "permit", "where": "kitchen"}, None, "nobody has told me not to go into"),
        ({"do": "forbid", "what": "mood"}, None, "say what"),
    ],
)  # fmt: skip
def test_what_is_forbidden_stands_at_once_and_what_is_permitted_is_read_back(
    parser: CommandParser,
    monkeypatch: pytest.MonkeyPatch,
    step: Step,
    order: StandingOrder | None,
    question: str,
) -> None:
    reading(parser, monkeypatch, step)
    asked = replace(request("words about keys, kitchen and mood"), prohibitions=(KEYS,))
    if order is None:
        with pytest.raises(CannotBeDone, match=question):
            parser.propose(asked, soon())
        return
    found = parser.propose(asked, soon())
    assert found.order == order and order.question == question
    assert found.is_read_back is bool(question)
    assert [one.skill for one in found.plan.actions] == ["speak"]


def test_a_question_about_the_speaker_is_a_command_only_for_a_thing(parser: CommandParser) -> None:
    with pytest.raises(Declined, match="the one who speaks"):
        parser.propose(request("Can I stay up a bit longer, please?"), soon())
    handed = parser.propose(request("Can I have the red cup, please?"), soon())
    assert "hand_over" in [one.skill for one in handed.plan.actions]


def test_a_plan_of_it_passes_grounding_and_validation(parser: CommandParser) -> None:
    asked = request("I'd like you to head over to the kitchen")
    proposal = parser.propose(asked, soon())
    plan = checked(proposal.plan, asked)
    assert [one.skill for one in plan.actions] == ["navigate_to"]
    assert plan.actions[0].parameters == {"place": "kitchen"}


def test_what_has_failed_before_is_left_to_who_can_tell_what_is_left(parser: CommandParser) -> None:
    asked = replace(request("I'd like you to head over to the kitchen"), failed=("move() failed",))
    with pytest.raises(Declined, match="begin anew"):
        parser.propose(asked, soon())


@pytest.mark.parametrize(
    "text",
    [
        "what is the weather like today",
        "I think it is going to rain tomorrow",
        "how much is a flight to paris",
        "возьми красную чашку",
        "!!!",
        "word " * 80,
        "make me a sandwich",
    ],
)
def test_other_talk_gives_no_plan(parser: CommandParser, text: str) -> None:
    with pytest.raises(PlanError):
        parser.propose(request(text), soon())


def test_what_is_not_to_be_touched_is_a_standing_order(parser: CommandParser) -> None:
    order = parser.propose(request("don't touch the bottle"), soon()).order
    assert order is not None and order.forbids


def test_the_same_words_give_the_same_answer(parser: CommandParser) -> None:
    text = "take the blue ball, no, the red one, to the side table"
    first, second = parser.parse(text, soon()), parser.parse(text, soon())
    assert first == second


def test_words_that_were_hardly_heard_are_read_back(parser: CommandParser) -> None:
    text = "I'd like you to head over to the kitchen"
    typed = parser.propose(request(text), soon())
    assert (typed.is_unsure, typed.is_read_back) == (False, False)
    weights = parser.model.language.certainty
    assert weights is not None
    doubtful = 0.5 * (weights.decline_below + weights.read_back_below)
    heard = parser.propose(request(text, heard=doubtful), soon())
    assert heard.is_unsure
    assert heard.confidence == pytest.approx(doubtful, abs=0.001)
    with pytest.raises(Declined, match="not sure"):
        parser.propose(request(text, heard=0.5 * weights.decline_below), soon())


def test_a_command_that_is_late_or_was_called_in_leaves_no_plan(parser: CommandParser) -> None:
    with pytest.raises(Declined, match="time is up"):
        parser.propose(request("go to the kitchen"), soon(within_s=0.0))
    recall = Event()
    recall.set()
    with pytest.raises(Declined, match="nobody waits"):
        parser.propose(request("go to the kitchen"), soon(recall))


@pytest.mark.parametrize("name", ["model.onnx", "tokenizer.json", "known_words.txt"])
def test_a_file_that_is_half_written_or_not_there_is_refused(tmp_path: Path, name: str) -> None:
    folder = Path(shutil.copytree(EMBEDDED / "command_parser", tmp_path / "command_parser"))
    file = folder / name
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(ModelFileSpoiled, match=name):
        open_command_parser(stored(tmp_path), PLAIN_CHOICE)
    file.unlink()
    with pytest.raises(InferenceError, match=name):
        open_command_parser(stored(tmp_path), PLAIN_CHOICE)
