"""Decide whether what was read in a phrase, or in one so far, stops the robot.

A stop too many does no harm: words that would be asked again as a command are enough for it, and
where they are not, other witnesses may be.
"""

from dataclasses import dataclass
from typing import Final

from vla_deploy.speech.recogniser import Reading
from vla_deploy.speech.words import holds_form_of_stop, holds_stop, is_stop

STOP_CONFIDENCE: Final = 0.25
"""A stop is taken where another command would be asked again: a stop too many does no harm."""
CALL_SURETY: Final = 0.2
"""A call to stop of so unsure words needs an ear, if there is one, that is so sure: "oh" is read as
"halt"."""
STOP_WITHIN_CONFIDENCE: Final = 0.85
STOP_SUSPECTED_CONFIDENCE: Final = 0.5
"""The same, of a stop word anywhere among others: more words may be misread as one. The second is
enough where the spotter suspects one."""
STOP_HEARD_TWICE_CONFIDENCE: Final = 0.6
LEAST_SURETY: Final = 0.05
"""Less sure words than STOP_WITHIN_CONFIDENCE are no stop where the ear, if any, hears none; but
by STOP_HEARD_TWICE_CONFIDENCE they are where the spotter suspects one as well and nothing follows:
a glance may see "stop it" where "stopping" is said."""
SUSPECTED_SURETY: Final = 0.1
"""Words that are only as sure as STOP_SUSPECTED_CONFIDENCE need an ear that is so sure."""
WORDS_HEARD_SURETY: Final = 0.7
"""An ear so sure makes up for words that are hardly so, where the spotter suspects one as well:
while somebody speaks, too, who has gone on after the word."""
STOP_ODDS: Final = 0.2
"""What was at least by so much as likely as the words that were read counts beside them."""
SLIGHT_SUSPICION: Final = 0.3
SUSPICION: Final = 0.4
STRONG_SUSPICION: Final = 0.7
"""From these shares of its threshold on, what the spotter heard counts beside words that were read
within others, beside a stop that may have been read instead, and beside any word that may be one.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Enough:
    """Bound what three witnesses must say of a stop word in a phrase, each from 0 to 1.

    They are the ear for stop words, the share of what may have been said in which one is, and the
    spotter. Words read by more than `most_confidence` outweigh them.
    """

    surety: float
    share: float = 0.0
    suspicion: float = 0.0
    most_confidence: float = 1.0


STOP_WITNESSES: Final = (
    _Enough(surety=0.2, suspicion=0.7),
    _Enough(surety=0.5, share=0.3),
    _Enough(surety=0.6, suspicion=0.3, most_confidence=0.5),
    _Enough(surety=0.95, most_confidence=0.6),
)
"""Any of these rows is enough for a stop in a phrase that may be over, unless a form of such a word
was read. While somebody speaks, "stop" may become "stopped": then words alone count.
"""


def stops(
    reading: Reading, confidence: float, suspicion: float = 0.0, *, is_all: bool = True
) -> bool:
    """Tell whether words read by that confidence stop the robot; `is_all` unless more may follow.

    As on the stream, the word itself does, whatever is meant by it. The less sure the words are,
    the more the spotter must suspect one; then what may have been said instead counts, too.
    """
    likely = [one.text for one in reading.others if one.odds >= STOP_ODDS]
    is_read = holds_stop(reading.text, is_all=is_all)
    surety = reading.stop_surety
    is_unheard = surety is not None and surety < LEAST_SURETY
    if is_read and confidence >= _enough_of_words(suspicion, is_unheard and not is_all):
        return True
    if is_unheard:
        return False
    # The ear knows better than the guesses of a glance, as soon as the word has ended.
    possible = (reading.text, *(likely if is_all or surety is None else ()))
    if suspicion >= STRONG_SUSPICION and any(map(holds_stop, possible)):
        return True
    if is_all and suspicion >= SUSPICION and any(map(is_stop, likely)):
        return True
    is_call = is_all and is_stop(reading.text) and (surety is None or surety >= CALL_SURETY)
    if is_call and confidence >= STOP_CONFIDENCE:
        return True
    if is_read and suspicion >= SLIGHT_SUSPICION and _is_heard_too(surety, confidence):
        return True
    return is_all and _is_witnessed(reading, confidence, suspicion)


def _enough_of_words(suspicion: float, is_doubtful: bool) -> float:
    """Return by which confidence words stop the robot; `is_doubtful` if the ear hears none yet."""
    is_heard_twice = suspicion >= SLIGHT_SUSPICION and not is_doubtful
    return STOP_HEARD_TWICE_CONFIDENCE if is_heard_twice else STOP_WITHIN_CONFIDENCE


def _is_heard_too(surety: float | None, confidence: float) -> bool:
    """Tell whether the ear, if any, is sure enough of a word that was read and spotted, too."""
    if surety is not None and surety >= WORDS_HEARD_SURETY:
        return confidence >= STOP_CONFIDENCE
    is_heard = surety is None or surety >= SUSPECTED_SURETY
    return is_heard and confidence >= STOP_SUSPECTED_CONFIDENCE


def _is_witnessed(reading: Reading, confidence: float, suspicion: float) -> bool:
    """Tell whether other witnesses than the words that were read say enough of a stop."""
    surety = reading.stop_surety
    if surety is None or holds_form_of_stop(reading.text):
        return False
    share = _stop_share(reading)
    return any(
        surety >= row.surety
        and share >= row.share
        and suspicion >= row.suspicion
        and confidence <= row.most_confidence
        for row in STOP_WITNESSES
    )


def _stop_share(reading: Reading) -> float:
    """Return the share of what may have been said that holds a stop, each text by its odds."""
    texts = [(reading.text, 1.0), *((one.text, one.odds) for one in reading.others)]
    return sum(odds for text, odds in texts if holds_stop(text)) / sum(odds for _, odds in texts)
