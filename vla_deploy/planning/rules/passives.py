"""Turn what is to be done to a thing into a command to do it.

the bowl needs finding                  -> find the bowl
the phone should be left on the table   -> leave the phone on the table
i want the keys brought to me           -> bring the keys to me
"""

import re
from typing import Final

from vla_deploy.planning.rules.verbs import DOING, FORMS

# What FORMS and DOING lack, or put otherwise.
_MORE: Final = {
    "kept": "put", "lifted": "lift", "handed": "hand", "boxing": "box", "collected": "get",
    "removed": "get", "popped": "put", "stuck": "put", "deposited": "put", "transferred": "move",
    "held": "hold", "located": "find",
}  # fmt: skip
_THEM: Final = {"they": "them"}
_VERBS: Final = {
    **{
        form: verb
        for form, verb in FORMS.items()
        if (form != verb or form in ("put", "set"))
        and form.endswith(("ed", "en", "t", "n", "d", "ing"))
    },
    **DOING,
    **_MORE,
}
_VERB: Final = rf"(?P<verb>{'|'.join(sorted(_VERBS, key=len, reverse=True))})\b(?P<rest>[^,;.!?]*)"
_THING: Final = (
    r"(?P<thing>(?:the|my|our|that|this|those|these|both|all|what is in your)\b"
    r"(?: (?!to\b|and\b|you\b|i\b|we\b|be\b|should\b|is\b|are\b)[\w'&]+){0,8}?|it|they|that|this|"
    r"both(?: of them)?)"
)
_TO_BE: Final = (
    r"(?:needs? (?:to be )?|has to be |have to be |should be |must be |ought to be |can be |"
    r"could be |(?:is|are) to be |wants? (?:to be )?|could do with (?:being )?)"
)
_GOOD: Final = (
    r"(?:so |very |really |most )?(?:nice|great|good|lovely|helpful|kind|wonderful|brilliant|glad|"
    r"happy|grateful|delighted|ideal|best|better|perfect|a (?:great |big |real )?help)(?: of you)?"
)
_PATTERNS: Final = (
    re.compile(
        rf"(?:(?<=^)|(?<=, )|(?<=\. )|(?<=; )|(?<=and )|(?<=so )|(?<=\? ))(?:i think |i believe )?"
        rf"(?:that )?{_THING} {_TO_BE}{_VERB}"
    ),
    re.compile(
        rf"^(?P<thing>)(?:what|how about|(?:it|that)(?:'d| would) (?:be {_GOOD}|suit me(?: "
        r"better)?|help(?: me)?(?: a (?:great deal|lot|bit))?)|i(?:'d| would) (?:like it|love it|"
        rf"appreciate it|be {_GOOD})),? if you (?:could |would |were to )?{_VERB}"
    ),
    re.compile(rf"\bi(?:'d like| want| need| would like) {_THING} (?:to be )?{_VERB}"),
)


def in_active_voice(text: str) -> str:
    """Return a text in lower case with such a clause as a command."""
    for pattern in _PATTERNS:
        text = pattern.sub(_commanded, text)
    return text


def _commanded(found: re.Match[str]) -> str:
    thing = _THEM.get(found["thing"], found["thing"])
    return f"{_VERBS[found['verb']]} {thing}".strip() + found["rest"]
