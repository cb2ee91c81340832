"""Sure words stop at once; what other witnesses make likely stops if it is so twice."""

from dataclasses import replace
from typing import Any

import pytest

from vla_deploy.speech.reading import Alternative, Reading
from vla_deploy.speech.stopping import (
    TWICE_SURETY,
    Look,
    is_confirmed,
    is_likely,
    is_sure,
    wants_another,
)

READING = Reading(
    text="",
    log_probability=-0.9,
    no_speech=0.01,
    compression=0.9,
    language="en",
    duration_s=1.0,
    took_s=0.02,
)


def look(
    text: str,
    *others: tuple[str, float],
    surety: float | None = None,
    odds: float | None = None,
    confidence: float = 0.3,
    is_all: bool = True,
) -> Look:
    alternatives = tuple(Alternative(*one) for one in others)
    reading = replace(READING, text=text, others=alternatives, stop_surety=surety, stop_odds=odds)
    return Look(reading, confidence, is_all)


@pytest.mark.parametrize(
    ("surety", "odds", "suspicion", "likely"),
    [
        (0.5, 0.2, 0.65, True),
        (0.37, 0.95, 0.35, True),
        (0.37, 0.95, 0.25, False),
        (0.37, 0.85, 0.65, False),
        (0.33, 1.0, 0.9, False),
        (0.45, 0.95, 0.25, False),
        (0.45, 0.45, 0.35, True),
        (0.45, 0.45, 0.25, False),
        (0.5, 0.06, 0.35, True),
        (0.5, 0.06, 0.25, False),
        (0.5, 0.04, 0.65, False),
        (0.43, 0.3, 0.65, False),
        (0.65, 0.65, 0.0, True),
        (0.65, 0.55, 0.0, False),
        (0.55, 0.9, 0.0, False),
        (0.85, 0.12, 0.0, True),
        (0.85, 0.08, 0.0, False),
        (0.75, None, 0.5, False),
        (0.85, None, 0.5, False),
        (None, None, 0.9, False),
    ],
)
def test_three_witnesses_make_likely_together_what_no_words_would(
    surety: float | None, odds: float | None, suspicion: float, likely: bool
) -> None:
    asked = look("you should hope", surety=surety, odds=odds)
    assert is_likely(asked, suspicion) is likely
    assert not is_sure(asked, suspicion)
    assert not is_likely(replace(asked, is_all=False), suspicion)


def test_a_stop_that_the_search_found_is_as_good_as_one_it_was_asked_for() -> None:
    first, second = (look("you his sock", surety=0.85, odds=one) for one in (0.01, None))
    assert not is_likely(first, 0.0)
    found = replace(first.reading, others=(Alternative("you should stop", 0.8),))
    assert is_likely(replace(first, reading=found), 0.0)
    assert is_likely(look("you his sock", ("you should stop", 0.8), surety=0.85), 0.0)
    assert not is_confirmed(first, second, 0.9)


def test_but_not_where_a_form_of_a_stop_was_read() -> None:
    stopped = look("he stopped at the shop", ("he stop at the shop", 0.9), surety=0.99, odds=0.9)
    assert not is_likely(stopped, 0.55)


def test_words_that_were_read_for_sure_outweigh_the_ear() -> None:
    reading = look("which cup", surety=0.96)
    assert is_likely(replace(reading, confidence=0.75), 0.35)
    assert not is_likely(replace(reading, confidence=0.75), 0.25)
    assert not is_likely(replace(reading, confidence=0.85), 0.35)


def test_words_that_the_spotter_suspects_too_need_an_ear_that_does_not_rule_them_out() -> None:
    read = look("you should halt", surety=0.03, confidence=0.45)
    assert is_likely(read, 0.35)
    assert not is_likely(read, 0.25)
    assert not is_likely(replace(read, confidence=0.35), 0.35)
    for surety, likely in ((0.01, False), (None, True)):
        heard = replace(read, reading=replace(read.reading, stop_surety=surety))
        assert is_likely(heard, 0.35) is likely


def test_a_mere_call_that_the_spotter_suspects_too_may_be_read_hardly() -> None:
    call = look("hey, halt", surety=0.03, confidence=0.2)
    assert is_likely(call, 0.35)
    assert not is_likely(call, 0.25)
    assert not is_likely(replace(call, confidence=0.1), 0.35)
    assert not is_likely(replace(call, is_all=False), 0.35)
    assert not is_likely(look("hey, halt the", surety=0.03, confidence=0.2), 0.35)


def test_and_while_somebody_speaks_one_that_hears_some_of_it() -> None:
    glance = look("we halt the", surety=0.25, confidence=0.45, is_all=False)
    assert is_likely(glance, 0.35)
    assert not is_likely(replace(glance, reading=replace(glance.reading, stop_surety=0.15)), 0.35)


@pytest.mark.parametrize(("suspicion", "confidence"), [(0.0, 0.7), (0.9, 0.55)])
@pytest.mark.parametrize("text", ["halt", "the red freeze"])
def test_unsure_words_are_no_stop_where_the_ear_hears_none(
    text: str, suspicion: float, confidence: float
) -> None:
    unheard = look(text, surety=0.01, confidence=confidence)
    assert not is_sure(unheard, suspicion)
    assert not is_likely(unheard, suspicion)
    assert is_sure(replace(unheard, confidence=0.9), suspicion)
    assert is_likely(look("halt", confidence=0.6), suspicion)


@pytest.mark.parametrize(("surety", "likely"), [(0.25, True), (0.15, False), (None, True)])
def test_hardly_read_words_need_an_ear_that_hears_some_of_it(
    surety: float | None, likely: bool
) -> None:
    hardly = look("she halt me a scarf", surety=surety, confidence=0.2)
    assert is_likely(hardly, 0.65) is likely


def test_words_that_the_spotter_suspects_too_need_no_ear() -> None:
    unheard = look("stop before you hit the chair", surety=0.0, confidence=0.75)
    assert is_sure(unheard, 0.35)
    assert not is_sure(unheard, 0.25)


def test_but_while_somebody_speaks_they_do_where_they_may_be_half_of_another_word() -> None:
    glance = look("up to the window and stop it", surety=0.0, confidence=0.75, is_all=False)
    assert is_sure(replace(glance, is_all=True), 0.35)
    assert not is_sure(glance, 0.35)
    for surety in (0.25, None):
        assert is_sure(replace(glance, reading=replace(glance.reading, stop_surety=surety)), 0.35)
    assert is_sure(replace(glance, confidence=0.9), 0.35)


def test_while_somebody_speaks_only_what_was_read_helps_a_strong_suspicion() -> None:
    start = look("start by", ("stop by", 0.5), surety=0.8, confidence=0.2)
    assert is_likely(start, 0.75)
    assert not is_likely(replace(start, is_all=False), 0.75)


def test_while_somebody_speaks_a_word_may_go_on_and_words_alone_count() -> None:
    assert not is_likely(look("he", surety=0.99, is_all=False), 0.0)
    assert is_sure(look("stop the arm", surety=0.0, confidence=0.9, is_all=False), 0.0)
    assert not is_sure(look("the arm stop", surety=0.0, confidence=0.9, is_all=False), 0.0)


@pytest.mark.parametrize(("surety", "stops"), [(0.9, True), (0.8, False), (None, False)])
@pytest.mark.parametrize("read", ["halt right", "you must halt before"])
def test_but_words_before_the_last_count_where_the_ear_is_sure(
    read: str, surety: float | None, stops: bool
) -> None:
    glance = look(read, surety=surety, confidence=0.1, is_all=False)
    assert is_likely(glance, 0.0) is stops
    assert not is_likely(replace(glance, confidence=0.08), 0.0)
    assert is_confirmed(glance, glance, 0.0) is stops
    assert not is_sure(glance, 0.0)
    assert not is_confirmed(look("halt", surety=0.99, is_all=False), glance, 0.0)


@pytest.mark.parametrize(("surety", "likely"), [(0.55, True), (0.45, False), (None, True)])
def test_a_form_that_was_read_asks_for_a_surer_ear(surety: float | None, likely: bool) -> None:
    forms = look("the arm has stopped", ("the arm has stop", 0.5), surety=surety)
    assert is_likely(forms, 0.65) is likely


def test_what_is_likely_twice_is_confirmed() -> None:
    first = look("halt", surety=0.3)
    assert is_confirmed(first, look("halt you", surety=0.2, confidence=0.45), 0.4)
    assert is_confirmed(first, look("halt", surety=0.0, confidence=0.9), 0.4)
    assert not is_confirmed(first, look("hold your", surety=0.04), 0.4)
    assert not is_confirmed(look("hold", surety=0.2), look("halt", surety=0.3), 0.0)


@pytest.mark.parametrize(("surety", "stops"), [(0.9, True), (0.8, False), (None, True)])
def test_while_somebody_goes_on_the_ear_has_to_be_surer_the_second_time(
    surety: float | None, stops: bool
) -> None:
    first = look("we halt the", surety=0.8, confidence=0.45, is_all=False)
    second = look("we halt the way", surety=surety, confidence=0.45, is_all=False)
    assert is_confirmed(first, second, 0.4) is stops


SURE: Any = {"surety": TWICE_SURETY + 0.01, "is_all": False}
SURER: Any = {"surety": 0.96, "odds": 0.04, "is_all": False}
SUREST: Any = {"surety": 0.98, "odds": 0.004, "is_all": False}


@pytest.mark.parametrize(
    ("first", "second", "suspicion", "stops"),
    [
        (look("halt", **SURE, odds=1.0), look("halt before you", **SURE, odds=1.0), 0.55, True),
        (look("store that", **SURE, odds=0.4), look("store", **SURE, odds=0.4), 0.55, True),
        (look("store that", **SURE, odds=0.4), look("store", **SURE, odds=0.4), 0.45, False),
        (look("store that", **SURE, odds=0.4), look("store", **SURE, odds=0.2), 0.55, False),
        (look("store that", **SURE), look("store", **SURE), 0.55, False),
        (look("up", **SURER), look("up", **SURER), 0.65, True),
        (look("up", **SURER), look("up", **SURER), 0.55, False),
        (look("up", **SURER), look("up", **SURE, odds=0.04), 0.65, False),
        (look("reading", **SUREST), look("reading", **SUREST), 0.45, True),
        (look("reading", **SUREST), look("reading", **SUREST), 0.35, False),
        (look("reading", **SUREST), look("reading", **SURER), 0.45, False),
        (look("in the hall", **SURER), look("in the hall", surety=0.99, odds=0.02), 0.75, False),
        (look("halt", **SURE, odds=1.0), look("halting", **SURE, odds=0.9), 0.55, False),
        (look("halt", **SURE, odds=1.0), look("halt the", surety=0.8, odds=1.0), 0.55, False),
    ],
)
def test_an_ear_that_is_sure_twice_needs_no_words_where_spotter_and_decoder_agree(
    first: Look, second: Look, suspicion: float, stops: bool
) -> None:
    assert wants_another(first, 0.0)
    assert is_confirmed(first, second, suspicion) is stops


@pytest.mark.parametrize(
    ("odds", "suspicion", "stops"),
    [
        ((0.04, 0.04), 0.9, False),
        ((0.04, 0.04), 1.0, True),
        ((0.02, 0.06), 0.9, True),
        ((None, 0.04), 0.9, False),
        ((None, None), 0.9, True),
    ],
)
def test_what_the_decoder_finds_unlikely_is_no_stop(
    odds: tuple[float | None, float | None], suspicion: float, stops: bool
) -> None:
    first, second = (look("in the hall", surety=0.93, odds=one) for one in odds)
    assert is_likely(first, suspicion)
    assert is_confirmed(first, second, suspicion) is stops
