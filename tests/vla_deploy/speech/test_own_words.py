"""A phrase may be the robot's own only while it sounds, and only if no person is known to speak."""

from typing import Final

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.speech.companions import Playing
from vla_deploy.speech.frames import Frame
from vla_deploy.speech.own_words import OUTLASTS_NS, OwnWords
from vla_deploy.speech.phrases import Phrase
from vla_deploy.speech.voice_activity import FRAME

SAYING: Final = Playing(say_id="s", text="Shall I go to the kitchen?", level_db=-20.0)
DIED_NS: Final = NS_PER_S
SILENCE: Final = np.zeros(FRAME, np.float32)


def frame(end_ns: int) -> Frame:
    made = Frame(stamp_ns=0, samples=SILENCE, follows=True)
    return Frame(stamp_ns=end_ns - made.end_ns, samples=SILENCE, follows=True)


def phrase(ended_ns: int) -> Phrase:
    return Phrase(
        number=1,
        began_ns=0,
        ended_ns=ended_ns,
        voiced_s=1.0,
        clipped_ratio=0.0,
        voice=0.9,
        samples=SILENCE,
    )


@pytest.fixture
def own() -> OwnWords:
    """Let the robot sound until `DIED_NS`."""
    own = OwnWords()
    own.follow(frame(DIED_NS), SAYING)
    return own


def test_what_begins_while_the_robot_sounds_may_be_its_own(own: OwnWords) -> None:
    own.note_begun(is_person=False)
    own.follow(frame(2 * DIED_NS), None)
    assert own.within(phrase(DIED_NS)) == SAYING.text
    assert own.within(phrase(DIED_NS + OUTLASTS_NS)) == SAYING.text


def test_whoever_goes_on_when_the_robot_has_ended_is_a_person(own: OwnWords) -> None:
    own.note_begun(is_person=False)
    own.follow(frame(2 * DIED_NS), None)
    assert own.within(phrase(DIED_NS + OUTLASTS_NS + 1)) == ""


def test_what_begins_after_the_robots_sound_is_a_persons(own: OwnWords) -> None:
    own.follow(frame(DIED_NS + 1), None)
    own.note_begun(is_person=True)
    assert own.within(phrase(DIED_NS)) == ""


def test_whoever_has_barged_in_is_a_person_from_the_first_word_on(own: OwnWords) -> None:
    own.note_begun(is_person=False)
    own.note_barged_in()
    assert own.within(phrase(DIED_NS)) == ""
    own.note_begun(is_person=True)
    assert own.within(phrase(DIED_NS)) == ""


def test_the_next_phrase_is_judged_by_itself(own: OwnWords) -> None:
    own.note_barged_in()
    own.note_begun(is_person=False)
    assert own.within(phrase(DIED_NS)) == SAYING.text
