"""Leave out what a command is for, or why it is urgent, said behind it: the robot goes at once.

"take the red book before the toddler does", "fetch it here so i don't have to get up", "wait twenty
seconds while i get past", "take the keys, chop chop"
"""

import re
from typing import Final

_PERSON: Final = (
    r"(?:i|we|he|she|it|they|someone|somebody|anyone|anybody|everyone|everybody|"
    r"(?:the|my|our) \w+(?: \w+)?)"
)
_HARM: Final = (
    r"(?:(?:gets?|is|are|'s|'re) (?:lost|broken|wet|dirty|stolen|trodden|crushed|cold)|"
    r"does|do|sits?|steps?|treads?|trips?|falls?|rolls?|breaks?|spills?|drops?|knocks?|kicks?|"
    r"grabs?|takes?|gets? (?:it|them|there|to it|hold)|finds?|eats?|wakes?|notices?)"
)
_BEHIND: Final = tuple(
    re.compile(rf",? {pattern}[ .!?,]*$")
    for pattern in (
        rf"before {_PERSON} {_HARM}\b[^,;.!?]*",
        rf"so (?:that )?{_PERSON} (?:don't|doesn't|do not|does not|won't|will not|can|can't|cannot|"
        r"could|needn't|may) (?!you\b)[^,;.!?]+",
        r"as an? (?:test|favou?r|treat|surprise|experiment)\b[^,;.!?]*",
        r"for (?:safe ?keeping|the time being|good measure|a change|a start)",
        r"(?:chop chop|hurry(?: up)?|be quick(?: about it)?|quick(?:ly)?|snappy|asap|sharpish|"
        r"go on|"
        r"there's a (?:dear|love|pal|good \w+)|if you (?:can )?manage(?: it| that)?|"
        r"if you'd be so kind|if it's no (?:trouble|bother))",
        r"(?:with|in|using) (?:your|the) (?:free|empty|spare) (?:hand|gripper|arm)",
    )
)


# Only what stands still does that while somebody does something: all else would be done too soon.
_WAITING: Final = re.compile(
    r"(?P<own>\W*(?:(?:please|robot|just|now|can you|could you|would you) )*"
    r"(?:wait|hold|stay|stand|keep|pause|freeze)\b[^,;.!?]*?),? while (?:i|we) [^,;.!?]+[ .!?,]*"
)


def without_purpose(text: str) -> str:
    """Return a command in lower case without what it is for; one that is nothing else stays."""
    while True:
        before = text
        for pattern in _BEHIND:
            text = pattern.sub("", text) or text
        text = _WAITING.sub(r"\g<own>", text)
        if text == before:
            return text
