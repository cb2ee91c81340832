import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.model_servers.errors import AnswerEmpty, AnswerMalformed
from vla_deploy.model_servers.json_answer import objects_in, strict_json

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)  # fmt: skip
OBJECTS = st.dictionaries(st.text(), VALUES, max_size=5)
PROSE = st.text().filter(lambda text: "{" not in text and "<think" not in text)


@given(PROSE, OBJECTS, PROSE)
def test_an_object_is_found_whatever_prose_is_around_it(before: str, value: dict, after: str):
    assert objects_in(f"{before}{json.dumps(value)}{after}") == [value]


@given(st.text())
def test_any_text_gives_objects_or_one_of_two_errors(text: str):
    try:
        assert all(isinstance(found, dict) for found in objects_in(text))
    except (AnswerEmpty, AnswerMalformed) as error:
        assert str(error)


@given(OBJECTS.filter(bool), st.data())
def test_a_truncated_object_gives_none_of_its_parts(value: dict, data: st.DataObject):
    text = json.dumps({"outer": value})
    cut = text[: data.draw(st.integers(1, len(text) - 1))]
    with pytest.raises(AnswerMalformed, match="JSON object"):
        objects_in(cut)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('```json\n{"a": 1}\n```', [{"a": 1}]),
        ('First {"a": 1}, better: {"a": 2}.', [{"a": 1}, {"a": 2}]),
        ('<think>perhaps {"a": 1}?</think>{"a": 2}', [{"a": 2}]),
        ('{"a": "<think>"} {"b": 1}', [{"a": "<think>"}, {"b": 1}]),
        ('a set {x | x > 1} and {"a": 1}', [{"a": 1}]),
    ],
)
def test_what_models_write_around_their_answer_is_left_out(text: str, found: list):
    assert objects_in(text) == found


@pytest.mark.parametrize(
    "text",
    [
        '{"a": ' * 100_000,
        '{"a": NaN}',
        '{"a": ' + "9" * 5000 + "}",
        '{"a":' + "[" * 70 + "]" * 70 + "}",
        "[1, 2]",
        "{" * 200_000,
        '{"a"' * 200_000,
        '<think>{"a": 1}',
        '{"outer": {"a\\"{}',  # cut off inside a string
    ],
)
def test_hostile_text_is_malformed_and_costs_little(text: str):
    with pytest.raises(AnswerMalformed):
        objects_in(text)


@pytest.mark.parametrize("text", ["", "  \n"])
def test_no_text_is_an_empty_answer(text: str):
    with pytest.raises(AnswerEmpty):
        objects_in(text)


@pytest.mark.parametrize("text", ["[" * 100_000, "NaN", "{", "{} {}"])
def test_strict_json_takes_json_alone(text: str):
    with pytest.raises(ValueError, match=r"."):
        strict_json(text)
