"""Say recollections as people do, a sentence each."""

from typing import Final

from vla_deploy.memory.episode import Episode, EpisodeOutcome, LastSeen

_MINUTE_S: Final = 60.0
_HOUR_S: Final = 3600.0
_DAY_S: Final = 86_400.0
_ENDS: Final = {
    EpisodeOutcome.SUCCEEDED: "and it was done",
    EpisodeOutcome.FAILED: "and it failed",
    EpisodeOutcome.REFUSED: "and it was refused",
}


def ago(elapsed_s: float) -> str:
    """Return how long ago something was: "just now", "5 minutes ago", "2 days ago"."""
    if elapsed_s < _MINUTE_S:
        return "just now"
    for unit_s, limit_s, word in (
        (_MINUTE_S, _HOUR_S, "minute"),
        (_HOUR_S, _DAY_S, "hour"),
        (_DAY_S, float("inf"), "day"),
    ):
        if elapsed_s < limit_s:
            count = int(elapsed_s // unit_s)
            return f"{count} {word}{'s' if count > 1 else ''} ago"
    raise AssertionError("the last unit has no limit")


def sentence_of(episode: Episode, now_s: float) -> str:
    """Return an episode in a sentence."""
    because = f": {episode.error}" if episode.error else ""
    said = f'{ago(now_s - episode.told_s)} I was told "{episode.command}"'
    return f"{said[0].upper()}{said[1:]} {_ENDS[episode.outcome]}{because}."


def place_words(thing: LastSeen, now_s: float) -> str:
    """Return where a thing was in a sentence."""
    return f"I saw the {thing} {at_words(thing.place)}, {ago(now_s - thing.seen_s)}."


def at_words(place: str) -> str:
    """Return where a place is as one says it: "near the kitchen", "in my left hand"."""
    words = place.replace("_", " ")
    for start, said in (("floor near ", "on the floor near the "), ("near ", "near the ")):
        if words.startswith(start):
            return said + words.removeprefix(start)
    return f"in my {words}" if words.endswith(" hand") else f"at the {words}"
