"""A home's own words are read as what the robot knows, and refused where they cannot be."""

import dataclasses

import pytest

from vla_deploy.robots import load_robot
from vla_deploy.robots.known_things import OwnWord
from vla_deploy.world.own_words import OwnWords, word_faults

WORDS = OwnWords(
    (
        OwnWord(said="thermos", means="green bottle"),
        OwnWord(said="Grandma's cup", means="white cup"),
        OwnWord(said="grandma's", means="small grey object"),
    )
)


@pytest.mark.parametrize(
    ("said", "read"),
    [
        ("bring me the thermos", "bring me the green bottle"),
        ("Thermos!", "green bottle!"),
        ("put grandma’s  cup by the Thermos", "put white cup by the green bottle"),
        ("bring me Grandma's", "bring me small grey object"),
        ("bring me the thermoses", "bring me the thermoses"),
        ("take the thermos's lid", "take the thermos's lid"),
    ],
)
def test_they_are_read_whole_and_the_longest_first(said: str, read: str) -> None:
    assert WORDS.read(said) == read


def test_without_any_a_text_is_as_it_is() -> None:
    assert OwnWords(()).read("put it  there’s") == "put it  there’s"


@pytest.mark.parametrize(
    ("said", "means", "fault"),
    [
        ("thermos", "green bottle", ""),
        ("thermos", "green thermos", "words[0].means"),
        ("mug", "green bottle", "words[0].said"),
        ("living room", "green bottle", "words[0].said"),
        ("desk lamp", "red can", ""),
    ],
)
def test_what_means_something_already_or_nothing_is_a_fault(
    said: str, means: str, fault: str
) -> None:
    words = (OwnWord(said=said, means=means),)
    robot = dataclasses.replace(load_robot("butler"), words=words)
    assert [one.key for one in word_faults(robot)] == ([fault] if fault else [])


def test_the_same_word_twice_is_a_fault() -> None:
    word = OwnWord(said="thermos", means="green bottle")
    robot = dataclasses.replace(load_robot("butler"), words=(word, word))
    assert [one.key for one in word_faults(robot)] == ["words[1].said"]
