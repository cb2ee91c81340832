"""Words that are not enough for a stop are, where other witnesses say enough."""

from dataclasses import replace
from typing import Any

import pytest

from vla_deploy.speech.recogniser import Alternative, Reading
from vla_deploy.speech.stopping import stops

READING = Reading(
    text="",
    log_probability=-0.9,
    no_speech=0.01,
    compression=0.9,
    language="en",
    duration_s=1.0,
    took_s=0.02,
)


def heard(text: str, *others: tuple[str, float], surety: float | None, **told: Any) -> Reading:
    alternatives = tuple(Alternative(one, odds) for one, odds in others)
    return replace(READING, text=text, others=alternatives, stop_surety=surety, **told)


@pytest.mark.parametrize(
    ("reading", "suspicion", "is_stop"),
    [
        (heard("you should hold", surety=0.97), 0.0, True),
        (heard("up", surety=0.25), 0.8, True),
        (heard("up", surety=0.25), 0.6, False),
        (heard("you should hold", surety=0.7), 0.0, False),
        (heard("you should hold", ("you should halt", 0.6), surety=0.55), 0.0, True),
        (heard("you should hold", ("you should halt", 0.6), surety=0.4), 0.0, False),
        (heard("you should hold", ("you should halt", 0.2), surety=0.55), 0.0, False),
        (heard("please, please", surety=0.65), 0.35, True),
        (heard("please, please", surety=0.65), 0.25, False),
        (heard("please, please", surety=0.55), 0.35, False),
        (heard("please, please", surety=None), 0.6, False),
        (heard("he stopped at the shop", ("he stop at the shop", 0.9), surety=0.99), 0.6, False),
    ],
)
def test_three_witnesses_stop_together_what_no_words_would(
    reading: Reading, suspicion: float, is_stop: bool
) -> None:
    assert stops(reading, 0.3, suspicion) is is_stop


def test_words_that_were_read_for_sure_outweigh_the_ear() -> None:
    reading, surer = heard("which cup", surety=0.7), heard("which cup", surety=0.97)
    assert stops(reading, 0.5, 0.5)
    assert not stops(reading, 0.55, 0.5)
    assert stops(surer, 0.55, 0.5)
    assert not stops(surer, 0.65, 0.5)


@pytest.mark.parametrize(("suspicion", "confidence"), [(0.0, 0.7), (0.9, 0.55)])
@pytest.mark.parametrize("text", ["halt", "the red freeze"])
def test_unsure_words_are_no_stop_where_the_ear_hears_none(
    text: str, suspicion: float, confidence: float
) -> None:
    assert not stops(heard(text, surety=0.02), confidence, suspicion)
    assert stops(heard(text, surety=0.02), 0.9, suspicion)
    assert stops(heard("halt", surety=None), 0.6, suspicion)


def test_words_that_the_spotter_suspects_too_need_no_ear() -> None:
    reading = heard("stop before you hit the chair", surety=0.0)
    assert stops(reading, 0.65, 0.35)
    assert not stops(reading, 0.65, 0.25)


def test_but_while_somebody_speaks_they_do_where_they_may_be_half_of_another_word() -> None:
    reading = heard("leaving up to the window and stop it", surety=0.0)
    assert stops(reading, 0.65, 0.35)
    assert not stops(reading, 0.65, 0.35, is_all=False)
    assert stops(replace(reading, stop_surety=0.06), 0.65, 0.35, is_all=False)
    assert stops(replace(reading, stop_surety=None), 0.65, 0.35, is_all=False)
    assert stops(reading, 0.9, 0.35, is_all=False)


def test_less_sure_words_that_the_spotter_suspects_need_an_ear_that_hears_some_of_it() -> None:
    reading = heard("halt you", surety=0.12)
    assert stops(reading, 0.55, 0.4)
    assert not stops(replace(reading, stop_surety=0.08), 0.55, 0.4)
    assert stops(replace(reading, stop_surety=None), 0.55, 0.4)


def test_while_somebody_speaks_only_what_was_read_helps_a_strong_suspicion() -> None:
    reading = heard("start by", ("stop by", 0.5), surety=0.9)
    assert stops(reading, 0.2, 0.75)
    assert not stops(reading, 0.2, 0.75, is_all=False)


def test_while_somebody_speaks_a_word_may_go_on_and_words_alone_count() -> None:
    assert not stops(heard("he", surety=0.99), 0.3, is_all=False)
    assert stops(heard("stop the arm", surety=0.0), 0.9, is_all=False)


def test_an_ear_that_is_sure_makes_up_for_words_that_are_not() -> None:
    going_on = heard("stop before you hit", surety=0.75)
    assert stops(going_on, 0.3, 0.35, is_all=False)
    assert not stops(going_on, 0.2, 0.35, is_all=False)
    assert not stops(going_on, 0.3, 0.25, is_all=False)
    assert not stops(replace(going_on, stop_surety=0.65), 0.3, 0.35, is_all=False)
    assert not stops(heard("you should stop", surety=0.75), 0.3, 0.35, is_all=False)


def test_an_unsure_call_to_stop_needs_an_ear_that_hears_some_of_it() -> None:
    assert stops(heard("halt", surety=0.25), 0.4, 0.0)
    assert stops(heard("halt", surety=None), 0.4, 0.0)
    assert not stops(heard("halt", surety=0.15), 0.4, 0.0)
    assert stops(heard("halt", surety=0.15), 0.9, 0.0)
