"""Say in words what an answer means, to ask whether that is what was meant."""

from collections.abc import Mapping, Sequence
from typing import Final

from vla_deploy.planning.command_parser.grammar import Step

# What is said of a step, with the words of its fields; one that it lacks is left out.
_PATTERNS: Final[Mapping[str, tuple[str, ...]]] = {
    "go": ("go to", "where"),
    "pick": ("pick up", "what", "but not:except", "or else:else", "from:from", "with:arm"),
    "put": ("put", "what", "but not:except", "or else:else", "from:from", "how", "where"),
    "bring": ("bring", "what", "but not:except", "or else:else", "from:from", "to:to"),
    "give": ("give you what I hold",),
    "find": ("look for", "what", "or else:else", "at:from"),
    "see": ("see whether there is", "what", "at:from", "and if so"),
    "await": ("begin now",),
    "forbid": ("leave alone from now on", "what", "where"),
    "permit": ("go back to using", "what", "where"),
    "where": ("look for", "what"),
    "look": ("look", "way", "at:what"),
    "move": ("move", "way", "by"),
    "turn": ("turn", "way", "by"),
    "open": ("open my", "arm", ":hand"),
    "close": ("close my", "arm", ":hand"),
    "pose": ("bring my arms to", "name"),
    "say": ("say", "text"),
    "wait": ("wait", "by"),
    "stop": ("stand still",),
    "ask": ("answer you",),
    "tidy": ("tidy up", "where"),
}
_FIELDS: Final = frozenset({"where", "what", "how", "way", "by", "arm", "name", "text"})


def question(steps: Sequence[Step]) -> str:
    """Return the question whether these steps are meant."""
    return f"Shall I {', then '.join(map(_words, steps))}?"


def _words(step: Step) -> str:
    said: list[str] = []
    for part in _PATTERNS[step["do"]]:
        before, _, field = part.rpartition(":")
        if part.startswith(":"):
            said.append(field)
        elif before:
            said += [before, step[field]] if field in step else []
        elif part in _FIELDS:
            said += [step[part]] if part in step else []
        else:
            said.append(part)
    return " ".join(said)
