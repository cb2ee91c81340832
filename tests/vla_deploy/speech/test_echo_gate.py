"""The robot does not hear itself, and a person may speak into what it says."""

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from vla_deploy.speech.echo_gate import BARGE_FRAMES, OUTLASTS_NS, EchoGate
from vla_deploy.speech.endpointing import Phrase
from vla_deploy.speech.sound import FRAME, NOTHING, Playing, SoundBlock, duration_ns, level_db

ECHO_DB = -38.0
TEXT = "I am on my way"
FRAME_NS = duration_ns(FRAME)
NOISE = np.random.default_rng(5).standard_normal(FRAME).astype(np.float32)


def saying(say_id: str = "s", echo_db: float = ECHO_DB) -> Playing:
    return Playing(say_id=say_id, text=TEXT, echo_db=echo_db)


class Ear:
    """Feed a gate frame by frame."""

    def __init__(self) -> None:
        self.gate = EchoGate()
        self.now_ns = NS_PER_S

    def hear(
        self, frames: int, at_db: float, playing: Playing | None = None, voice: float = 0.98
    ) -> int:
        """Return in how many frames a person is heard."""
        samples = NOISE * np.float32(10.0 ** ((at_db - level_db(NOISE)) / 20.0))
        persons = 0
        for _ in range(frames):
            frame = SoundBlock(stamp_ns=self.now_ns, samples=samples)
            self.now_ns = frame.end_ns
            persons += self.gate.persons_voice(frame, voice, playing) == voice
        return persons


def phrase(began_ns: int, ended_ns: int) -> Phrase:
    return Phrase(began_ns=began_ns, ended_ns=ended_ns, samples=NOTHING)


@pytest.fixture
def ear() -> Ear:
    return Ear()


def test_its_own_voice_is_no_persons_whatever_the_network_says(ear: Ear) -> None:
    draw = np.random.default_rng(5)
    for echo_db in ECHO_DB - 25.0 * draw.random(300) ** 3:  # words, and the gaps between them
        assert ear.hear(1, echo_db - 1.0, saying(echo_db=echo_db)) == 0
    assert not ear.gate.barged_in


def test_a_person_who_is_louder_than_the_echo_barges_in_and_is_heard_from_then_on(ear: Ear) -> None:
    assert ear.hear(BARGE_FRAMES - 1, -28.0, saying()) == BARGE_FRAMES - 1
    assert not ear.gate.barged_in
    assert ear.hear(1, -28.0, saying()) == 1
    assert ear.gate.barged_in
    assert ear.hear(3, -60.0, saying()) == 3
    ear.hear(1, -60.0)
    assert ear.gate.barged_in, "it is told until the robot speaks again"
    assert ear.hear(3, -60.0, saying("next")) == 0
    assert not ear.gate.barged_in


def test_a_loud_sound_that_is_no_voice_does_not_barge_in(ear: Ear) -> None:
    assert ear.hear(20, -10.0, saying(), voice=0.4) == 0
    assert not ear.gate.barged_in


def test_while_the_robot_is_silent_everything_is_heard(ear: Ear) -> None:
    assert ear.hear(5, -70.0, voice=0.1) == 5


@pytest.mark.parametrize(
    ("began_frame", "ended_ns", "own"),
    [
        (0, 0, True),
        (9, OUTLASTS_NS, True),
        (9, OUTLASTS_NS + 1, False),  # whoever goes on when the robot has ended is a person
        (10, 0, False),  # and who begins then
        (-1, 0, False),  # or has begun before
    ],
)
def test_what_begins_and_ends_with_the_robots_sound_may_be_its_own(
    ear: Ear, began_frame: int, ended_ns: int, own: bool
) -> None:
    began_ns = ear.now_ns
    ear.hear(10, -60.0, saying())
    died_ns = ear.now_ns
    ear.hear(20, -60.0)
    heard = phrase(began_ns + began_frame * FRAME_NS, died_ns + ended_ns)
    assert ear.gate.own_words(heard).strip() == (TEXT if own else "")


def test_of_two_texts_in_a_row_either_may_be_its_own(ear: Ear) -> None:
    began_ns = ear.now_ns
    ear.hear(10, -60.0, saying("a"))
    ear.hear(10, -60.0, saying("b"))
    assert ear.gate.own_words(phrase(began_ns, ear.now_ns)) == f" {TEXT} {TEXT}"


def test_whoever_has_barged_in_is_a_person_from_the_first_word_on(ear: Ear) -> None:
    began_ns = ear.now_ns
    ear.hear(BARGE_FRAMES, -10.0, saying())
    assert ear.gate.own_words(phrase(began_ns, ear.now_ns)) == ""
