"""Say in words what an answer means, to ask whether that is what was meant."""

from collections.abc import Mapping, Sequence
from typing import Final

from vla_deploy.planning.command_parser.grammar import Step

# What is said of a step: words, each before the field behind the colon, with which they are left
# out where the step lacks it.
_SAID: Final[Mapping[str, tuple[str, ...]]] = {
    "go": ("go to", ":where"),
    "pick": ("pick up", ":what", "but not:except", "or else:else", "from:from", "with:arm"),
    "put": ("put", ":what", "but not:except", "or else:else", "from:from", ":how", ":where"),
    "bring": ("bring", ":what", "but not:except", "or else:else", "from:from", "to:to"),
    "give": ("give you what I hold",),
    "find": ("look for", ":what", "or else:else", "at:from"),
    "see": ("see whether there is", ":what", "at:from", "and if so"),
    "await": ("begin now",),
    "forbid": ("leave alone from now on", ":what", ":where"),
    "permit": ("go back to using", ":what", ":where"),
    "where": ("look for", ":what"),
    "look": ("look", ":way", "at:what"),
    "move": ("move", ":way", ":by"),
    "turn": ("turn", ":way", ":by"),
    "open": ("open my", ":arm", "hand"),
    "close": ("close my", ":arm", "hand"),
    "pose": ("bring my arms to", ":name"),
    "say": ("say", ":text"),
    "wait": ("wait", ":by"),
    "stop": ("stand still",),
    "ask": ("answer you",),
    "tidy": ("tidy up", ":where", "but not:except"),
}


def question(steps: Sequence[Step]) -> str:
    """Return the question whether these steps are meant."""
    return f"Shall I {', then '.join(map(_words, steps))}?"


def _words(step: Step) -> str:
    said: list[str] = []
    for part in _SAID[step["do"]]:
        before, _, field = part.partition(":")
        if not field or field in step:
            said += [before, step.get(field, "")]
    return " ".join(filter(None, said))
