"""Leave out what a command is for, or why it is urgent, said behind it.

"take the red book before the toddler does", "fetch it here so i don't have to get up", "wait twenty
seconds while i get past", "take the keys, chop chop". A condition behind it, or a further command,
is none of that: then all stays, for whoever refuses conditions to see.
"""

import re
from typing import Final

from vla_deploy.world.vocabulary import KIND_WORDS

_PERSON: Final = (
    r"(?:i|we|he|she|it|they|(?:anyone|anybody|somebody|someone)(?: (?:in|from|at) "
    r"(?:the|this|that|my|our) \w+)?|everyone|everybody|"
    rf"(?:the|my|our) (?!(?:\w+ )?(?:{KIND_WORDS})s?\b)\w+(?: \w+)?)"
)
_HARM: Final = (
    r"(?:(?:gets?|is|are|'s|'re) (?:lost|broken|wet|dirty|stolen|trodden|crushed|cold)|"
    r"does|do|sits?|steps?|treads?|trips?|falls?|rolls?|breaks?|spills?|drops?|knocks?|kicks?|"
    r"grabs?|takes?|loses?|forgets?|ruins?|spoils?|gets? (?:it|them|there|to it|hold)|finds?|"
    r"eats?|wakes?|notices?|goes (?:missing|down|off|cold|under|behind|everywhere)|"
    r"starts?|begins?|comes?|gets?|heads?|arrives?|leaves?|sees?)"
)
_REST: Final = (
    r"(?:(?!\b(?:if|when|whenever|until|till|unless|after|before|once|only|but|not yet|later|"
    r"as soon|as long|provided|and|then|or|no|never)\b)[^,;.!?])*"
)
# When that will be is nothing to wait for.
_WHAT_FOR: Final = (
    r"(?:(?!\b(?:if|unless|until|till|when|whenever|once|but|and|then|or)\b)[^,;.!?])*"
)
_BEHIND: Final = tuple(
    re.compile(rf",? {pattern}[ .!?,]*$")
    for pattern in (
        rf"before {_PERSON} {_HARM}\b{_REST}",
        rf"so (?:that )?{_PERSON} (?:don't|doesn't|do not|does not|won't|will not|can|can't|cannot|"
        rf"could|needn't|may) (?!you\b){_WHAT_FOR}",
        rf"as an? (?:test|favou?r|treat|surprise|experiment)\b{_REST}",
        r"for (?:safe ?keeping|the time being|good measure|a change|a start)",
        r"(?:chop chop|hurry(?: up)?|be quick(?: about it)?|quick(?:ly)?|snappy|asap|sharpish|"
        r"go on|there's a (?:dear|love|pal|good \w+)|if you (?:can )?manage(?: it| that)?|"
        r"if you'd be so kind|if it's no (?:trouble|bother))",
        r"with whichever hand (?:you (?:like|want|prefer)|is (?:free|nearer|closer))",
        r"(?:with|using) (?:your|the) (?:free|empty|spare) (?:hand|gripper|arm)",
    )
)
# Only what stands still does that while somebody does something: all else would be done too soon.
_WAITING: Final = re.compile(
    r"(?P<own>\W*(?:(?:please|robot|just|now|can you|could you|would you) )*"
    r"(?:wait|hold|stay|stand|pause)\b(?:(?!\b(?:and|then|but|or)\b)[^,;.!?])*?),? "
    rf"while (?:i|we) {_REST}[ .!?,]*"
)

# What stays put meanwhile needs nobody to wait for the end of it.
_STAYING: Final = re.compile(
    r"(?P<own>.*\b(?:put|pop|set|hang on to|hold on to|keep (?:it|them))\b[^,;.!?]+?),? (?:until|"
    rf"till) {_PERSON}(?:'\w+)? {_REST}[ .!?,]*"
)


def without_purpose(text: str) -> str:
    """Return a command in lower case without what it is for; one that is nothing else stays."""
    while True:
        before = text
        for pattern in _BEHIND:
            text = pattern.sub("", text) or text
        waiting = _WAITING.fullmatch(text) or _STAYING.fullmatch(text)
        text = text if waiting is None else waiting["own"]
        if text == before:
            return text
