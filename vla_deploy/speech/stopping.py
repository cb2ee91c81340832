"""Decide whether what was read in a phrase, or in one so far, stops the robot.

A stop too many does no harm: words that would be asked again as a command are enough for it, and
where they are not, other witnesses may be. But where it is not sure by its words, it has to be
likely twice: of a sentence that is cut off the end often sounds like one, and no more so when a
moment more of it is heard.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from vla_deploy.speech.reading import Reading
from vla_deploy.speech.words import holds_form_of_stop, holds_stop, is_stop

CALL_CONFIDENCE: Final = 0.15
"""A mere call to stop is taken where another command would be asked again."""
STOP_WITHIN_CONFIDENCE: Final = 0.85
STOP_SUSPECTED_CONFIDENCE: Final = 0.4
"""The same, of a stop word anywhere among others: more words may be misread as one. The second is
enough where the spotter suspects one."""
STOP_HEARD_TWICE_CONFIDENCE: Final = 0.6
HINT_SURETY: Final = 0.05
"""From here on what the ear hears is worth another look."""
LEAST_SURETY: Final = 0.2
"""Less sure words than STOP_WITHIN_CONFIDENCE are no stop where the ear, if any, hears none; but
by STOP_HEARD_TWICE_CONFIDENCE they are where the spotter suspects one as well and nothing follows:
a glance may see "stop it" where "stopping" is said."""
FORM_SURETY: Final = 0.5
"""The same where a form of a stop word was read, such as "stopped": it is misread more often as the
word than the word as it."""
READ_SURETY: Final = 0.02
"""Words that the spotter suspects too need no more than an ear that does not quite rule a stop out,
if nothing follows: it knows some voices less well than the recogniser does."""
STOP_ODDS: Final = 0.4
"""What was at least by so much as likely as the words that were read counts beside them."""
SLIGHT_SUSPICION: Final = 0.3
STRONG_SUSPICION: Final = 0.6
"""From these shares of its threshold on, what the spotter heard counts beside words that were read
within others or a stop that may have been read instead, and beside any word that may be one."""
TWICE_SURETY: Final = 0.9
"""From here on the ear asks for another look by itself: see TWICE_WITNESSES."""
GLANCED_SURETY: Final = 0.85
"""While somebody goes on, the ear, if any, has to be so sure the second time; where it is both
times, and a stop word was read by GLANCED_CONFIDENCE, nothing else is asked."""
GLANCED_CONFIDENCE: Final = 0.1
"""Less sure words of a sentence that goes on are anything that sounds a little like them."""
LEAST_ODDS: Final = 0.05
"""A stop that the decoder finds less likely than that both times is none, whatever else speaks for
one, unless the spotter has come to its threshold or a row of TWICE_WITNESSES asks for less."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Enough:
    """Bound what witnesses must say of a stop word in a phrase, each from 0 to 1.

    They are the ear for stop words, the spotter, and the decoder: how likely one was said instead
    (`_stop_odds`). Words read by more than `most_confidence` outweigh them.
    """

    surety: float
    suspicion: float = 0.0
    odds: float = 0.0
    most_confidence: float = 1.0


STOP_WITNESSES: Final = (
    _Enough(surety=0.35, suspicion=0.3, odds=0.9),
    _Enough(surety=0.4, suspicion=0.3, odds=0.4),
    _Enough(surety=0.45, suspicion=0.3, odds=0.05),
    _Enough(surety=0.6, odds=0.6),
    _Enough(surety=0.8, odds=0.1),
    _Enough(surety=0.9, suspicion=0.3, most_confidence=0.8),
)
"""Any of these rows is enough for a stop in a phrase that may be over, unless a form of such a word
was read. While somebody speaks, "stop" may become "stopped": then words alone count.
"""
TWICE_WITNESSES: Final = (
    _Enough(surety=TWICE_SURETY, suspicion=0.5, odds=0.3),
    _Enough(surety=0.95, suspicion=0.6, odds=0.03),
    _Enough(surety=0.97, suspicion=0.4, odds=0.003),
)
"""An ear that is so sure both times needs no words, if the other witnesses say so much both times:
also while somebody speaks, who has gone on after the word."""


@dataclass(frozen=True, slots=True)
class Look:
    """Hold what was read and by which confidence; `is_all` unless more may follow."""

    reading: Reading
    confidence: float
    is_all: bool = True


def is_sure(look: Look, suspicion: float) -> bool:
    """Tell whether the words that were read stop the robot at once.

    As on the stream, the word itself does, whatever is meant by it. `suspicion` is how near the
    spotter came to hearing one.
    """
    is_doubtful = _denies(look.reading, LEAST_SURETY) and not look.is_all
    is_heard_twice = suspicion >= SLIGHT_SUSPICION and not is_doubtful
    enough = STOP_HEARD_TWICE_CONFIDENCE if is_heard_twice else STOP_WITHIN_CONFIDENCE
    return holds_stop(look.reading.text, is_all=look.is_all) and look.confidence >= enough


def is_likely(look: Look, suspicion: float) -> bool:
    """Tell whether words and other witnesses speak for a stop, which a second look may confirm.

    The less sure the words are, the more the spotter must suspect one; then what may have been
    said instead counts, too.
    """
    reading, is_all = look.reading, look.is_all
    if _is_read(look, suspicion):
        return True
    if _denies(reading, FORM_SURETY if holds_form_of_stop(reading.text) else LEAST_SURETY):
        return False
    likely = [one.text for one in reading.others if one.odds >= STOP_ODDS]
    # The ear knows better than the guesses of a glance, as soon as the word has ended.
    possible = (reading.text, *(likely if is_all or reading.stop_surety is None else ()))
    if suspicion >= STRONG_SUSPICION and any(map(holds_stop, possible)):
        return True
    if is_all and suspicion >= SLIGHT_SUSPICION and any(map(is_stop, likely)):
        return True
    if _is_call(look):
        return True
    return is_all and _is_witnessed(look, suspicion)


def _is_read(look: Look, suspicion: float) -> bool:
    """Tell whether a stop word was read that others do not rule out.

    They are the ear, and the spotter, which must suspect one unless the ear is sure in a glance.
    """
    if not holds_stop(look.reading.text, is_all=look.is_all):
        return False
    if not look.is_all and _affirms(look.reading, GLANCED_SURETY):
        return look.confidence >= GLANCED_CONFIDENCE
    least = READ_SURETY if look.is_all else LEAST_SURETY
    is_heard = suspicion >= SLIGHT_SUSPICION and not _denies(look.reading, least)
    return is_heard and (_is_call(look) or look.confidence >= STOP_SUSPECTED_CONFIDENCE)


def _is_call(look: Look) -> bool:
    """Tell whether nothing but a call to stop was read, by enough confidence for one."""
    is_call = look.is_all and is_stop(look.reading.text)
    return is_call and look.confidence >= CALL_CONFIDENCE


def wants_another(look: Look, suspicion: float) -> bool:
    """Tell whether another look may confirm a stop."""
    return is_likely(look, suspicion) or _affirms(look.reading, TWICE_SURETY)


def hints(look: Look) -> bool:
    """Tell whether the ear hears anything like a stop, which another look may make likely."""
    return _affirms(look.reading, HINT_SURETY)


def is_confirmed(first: Look, second: Look, suspicion: float) -> bool:
    """Tell whether the same phrase, read again with a moment more of sound, stops the robot."""
    readings = first.reading, second.reading
    if any(_is_heard_twice(row, first, second, suspicion) for row in TWICE_WITNESSES):
        return True
    if suspicion < 1.0 and _are_unlikely(readings):
        return False
    if not first.is_all and _denies(second.reading, GLANCED_SURETY):
        return False
    is_still = is_sure(second, suspicion) or is_likely(second, suspicion)
    return is_still and is_likely(first, suspicion)


def _affirms(reading: Reading, least: float) -> bool:
    """Tell whether there is an ear that is so sure of a stop."""
    return reading.stop_surety is not None and reading.stop_surety >= least


def _denies(reading: Reading, least: float) -> bool:
    """Tell whether there is an ear that is not so sure of a stop."""
    return reading.stop_surety is not None and reading.stop_surety < least


def _stop_odds(reading: Reading) -> float | None:
    """Return how likely the decoder finds a stop: asked for one, or by its search; None if neither.

    Where it was heard as nothing but other words, no one of them stands where the stop was said.
    """
    asked = () if reading.stop_odds is None else (reading.stop_odds,)
    found = (one.odds for one in reading.others if holds_stop(one.text))
    return max((*asked, *found), default=None)


def _are_unlikely(readings: Sequence[Reading]) -> bool:
    """Tell whether the decoder was asked for a stop or found one, and never a likely one."""
    odds = [one for one in map(_stop_odds, readings) if one is not None]
    return bool(odds) and max(odds) < LEAST_ODDS


def _is_heard_twice(row: _Enough, first: Look, second: Look, suspicion: float) -> bool:
    return all(_is_enough(row, look, suspicion) for look in (first, second))


def _is_witnessed(look: Look, suspicion: float) -> bool:
    """Tell whether other witnesses than the words that were read say enough of a stop."""
    return any(_is_enough(row, look, suspicion) for row in STOP_WITNESSES)


def _is_enough(row: _Enough, look: Look, suspicion: float) -> bool:
    """Tell whether there is an ear, and all witnesses say so much; no form may have been read."""
    return (
        _affirms(look.reading, row.surety)
        and suspicion >= row.suspicion
        and (_stop_odds(look.reading) or 0.0) >= row.odds
        and look.confidence <= row.most_confidence
        and not holds_form_of_stop(look.reading.text)
    )
