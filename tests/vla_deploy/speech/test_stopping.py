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


def heard(text: str, *others: tuple[str, float], surety: float, **told: Any) -> Reading:
    alternatives = tuple(Alternative(one, odds) for one, odds in others)
    return replace(READING, text=text, others=alternatives, stop_surety=surety, **told)


@pytest.mark.parametrize(
    ("reading", "suspicion", "is_stop"),
    [
        (heard("you should hold", surety=0.99), 0.0, False),
        (heard("you should hold", ("you should halt", 0.3), surety=0.5), 0.0, True),
        (heard("you should hold", ("you should halt", 0.3), surety=0.1), 0.0, False),
        (heard("you should hold", ("you should halt", 0.04), surety=0.5), 0.0, False),
        (heard("please, please", surety=0.8), 0.45, True),
        (heard("please, please", surety=0.8), 0.35, False),
        (heard("please, please", surety=0.6), 0.45, False),
        (heard("he stopped at the shop", ("he stop at the shop", 0.9), surety=0.99), 0.6, False),
    ],
)
def test_three_witnesses_stop_together_what_no_words_would(
    reading: Reading, suspicion: float, is_stop: bool
) -> None:
    assert stops(reading, 0.3, suspicion) is is_stop


def test_words_that_were_read_for_sure_outweigh_the_head() -> None:
    reading, surer = heard("which cup", surety=0.9), heard("which cup", surety=0.96)
    assert stops(reading, 0.3, 0.5)
    assert not stops(reading, 0.4, 0.5)
    assert stops(surer, 0.4, 0.5)
    assert not stops(surer, 0.6, 0.5)


def test_while_somebody_speaks_a_word_may_go_on_and_words_alone_count() -> None:
    assert not stops(heard("he", surety=0.99), 0.3, is_all=False)
    assert stops(heard("stop the arm", surety=0.0), 0.9, is_all=False)
