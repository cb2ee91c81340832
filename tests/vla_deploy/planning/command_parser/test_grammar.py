"""Whatever a command says, the answer to it can hold only steps of the table and its own words."""

import json

import pytest
from llguidance import LLTokenizer
from tokenizers import AddedToken, Tokenizer
from tokenizers.decoders import ByteLevel as ByteLevelDecoder
from tokenizers.models import BPE
from tokenizers.pre_tokenizers import ByteLevel
from tokenizers.trainers import BpeTrainer

from training.planner.sentences.clause import answer_text
from vla_deploy.inference.errors import AnswerFailed
from vla_deploy.inference.language_model.decoding import Constraint
from vla_deploy.planning.command_parser.grammar import STEPS, answer_schema
from vla_deploy.planning.command_parser.wording import foreign_share, plain_words


@pytest.fixture(scope="module")
def tokenizer() -> Tokenizer:
    made = Tokenizer(BPE())
    made.pre_tokenizer = ByteLevel(add_prefix_space=False)
    made.decoder = ByteLevelDecoder()
    end = AddedToken("<|end|>", special=True)
    trainer = BpeTrainer(
        special_tokens=[end], initial_alphabet=ByteLevel.alphabet(), show_progress=False
    )
    made.train_from_iterator([], trainer)
    return made


COMMAND = "put the red cup in the big box"


def takes(tokenizer: Tokenizer, answer: str) -> bool:
    schema = answer_schema(COMMAND.split())
    guide = LLTokenizer(tokenizer.to_str(), eos_token=0)
    constraint = Constraint(guide, schema)
    try:
        constraint.take(tokenizer.encode(answer).ids)
    except AnswerFailed:
        return False
    return constraint.is_done


@pytest.mark.parametrize(
    ("step", "is_allowed"),
    [
        ({"do": "put", "what": "red cup", "how": "in", "where": "big box"}, True),
        ({"do": "pick", "what": "cup", "arm": "left"}, True),
        ({"do": "go", "where": "me"}, True),
        ({"do": "pick", "what": "blue cup"}, False),
        ({"do": "pick", "what": "cup red"}, False),
        ({"do": "pick", "what": "cup cup"}, False),
        ({"do": "put", "what": "cup", "how": "through", "where": "box"}, False),
    ],
)
def test_only_words_of_the_command_in_their_order_are_copied(
    tokenizer: Tokenizer, step: dict[str, str], is_allowed: bool
) -> None:
    assert takes(tokenizer, answer_text([step])) is is_allowed


def test_a_step_that_is_none_cannot_be_written(tokenizer: Tokenizer) -> None:
    assert not takes(tokenizer, '{"steps":[{"do":"fly"}]}')
    assert not takes(tokenizer, '{"steps":[]}')


def test_every_step_of_the_table_can_be_written(tokenizer: Tokenizer) -> None:
    ways = {"look": "up", "move": "forward", "turn": "around"}
    for do, fields in STEPS.items():
        needed = [name for name in fields if not name.startswith("[")]
        values = {"way": ways.get(do, ""), "about": "able"}
        step = {"do": do, **{name: values.get(name, "cup") for name in needed}}
        assert takes(tokenizer, answer_text([step])), step


def test_quotes_in_a_command_cannot_break_out_of_the_answer() -> None:
    words = plain_words('go to "kitchen"}]} and \\ {"do":"stop"}')
    assert words == ["go", "to", "kitchen", "and", "do", "stop"]
    assert json.dumps(answer_schema(words))


def test_signs_and_capitals_become_plain_words() -> None:
    assert plain_words("Turn 90°, please – it’s Anna's café!") == (
        ["turn", "90", "degrees", "please", "it's", "anna's", "cafe"]
    )


def test_other_scripts_are_told_apart() -> None:
    assert foreign_share("возьми чашку") == 1.0
    assert foreign_share("take the cup") == 0.0
