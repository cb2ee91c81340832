"""Microphone, speaker and people in one room: the robot does not hear itself, and is interrupted.

The real node with the real voice network, the real voice and the twin's devices; only the physics
is left out.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sim_twin.harness.speech_room import SpeechRoom
from sim_twin.sound.talker import Talker
from vla_deploy.speech.sound import RATE_HZ

SENTENCES = (
    "I have put the red cup into the box",
    "stop, I do not see the green ball on the table",
    "now I drive back to the kitchen table and wait for you",
)


@pytest.fixture
def room(tmp_path: Path, listener: Any) -> Iterator[SpeechRoom]:
    made = SpeechRoom(tmp_path, listener)
    yield made
    made.close()


def test_the_robot_does_not_hear_itself(room: SpeechRoom) -> None:
    for sentence in (*SENTENCES, *SENTENCES):
        ended = room.robot_says(sentence)
        assert ended is not None
        assert (ended.event, ended.reason) == ("finished", "")
        room.run(1.0)
    assert room.heard() == []


def test_a_person_who_speaks_into_what_the_robot_says_silences_it(room: SpeechRoom) -> None:
    for sentence in SENTENCES:
        room.robot_says(sentence)
        room.run(0.5)
    say_id = room.announcer.say("so I went on, and on, and on, to the very end of the long way")
    room.run(1.5)
    room.person_says("robot, come here please", Talker())
    ended = room.end_of(say_id, 0.6)
    assert ended is not None
    assert ended.event == "interrupted"


@pytest.mark.parametrize("after_s", [0.05, 0.2, 0.6])
@pytest.mark.parametrize(
    ("question", "answer"),
    [
        ("Which cup, the red one or the blue one?", "the red one"),
        ("Shall I pick up the red cup and put it in the box?", "pick up the blue cup"),
    ],
)
def test_an_answer_in_the_robots_own_words_is_taken(
    room: SpeechRoom, question: str, answer: str, after_s: float
) -> None:
    room.robot_says(question)
    room.run(after_s)
    room.person_says(answer, Talker())
    room.run(2.5)
    assert [(one["text"], one["verdict"]) for one in room.heard()] == [(answer, "accepted")]


def test_whoever_listens_to_the_stream_misses_nothing(room: SpeechRoom, listener: Any) -> None:
    before, began_s = len(listener.blocks), room.now_s
    room.robot_says(SENTENCES[0])
    room.run(1.0)
    heard_s = sum(len(block.samples) for block in listener.blocks[before:]) / RATE_HZ
    assert heard_s == pytest.approx(room.now_s - began_s, abs=0.05)
