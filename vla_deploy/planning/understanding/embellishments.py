"""Leave out of a description what tells nothing that a robot could see or know.

"the book i was reading" is "the book", "that red cup of mine" is "that red cup", "the phone that is
charging in the kitchen" is "the phone in the kitchen", "something to read" is "a book".
"""

import re
from typing import Final

_SOMEBODY: Final = (
    r"(?:i|we|you|she|he|they|someone|somebody|everybody|everyone|"
    r"(?:my|our|your|the|his|her) (?!one\b|thing\b|other\b)[a-z]+)"
)
_HAS: Final = (
    r"(?:'(?:ve|d|m|re|s|ll)| have| has| had| am| is| are| was| were| always| usually|"
    r" just| already| last| keep| keeps| once| really| so)*"
)
_LAID: Final = (
    r"(?:left|put|dropped|forgot|forgotten|saw|seen|laid|kept|placed|set|stood)(?: down)?"
)
_DID: Final = (
    r"(?:gave|bought|got|read|reads|reading|use|uses|used|using|like|likes|liked|love|loves|loved|"
    r"need|needs|needed|want|wants|wanted|mentioned|mean|meant|forgot|had|saw|seen|borrowed|took|"
    r"asked|play|plays|played|playing|prefer|prefers|own|owns|brought|made|wrote|found|washed|"
    r"drink|drinks|drank|drinking|eat|eats|ate|told|talked|spoke|showed|left|put|dropped|looking|"
    r"was|were|is|are|call|calls|lost)"
)
_AT: Final = r"(?=(?:on|in|inside|under|by|next to|near|beside|behind|at|on top of)\b)"
# Of the rest of what somebody did: neither where the thing is, nor that it is not so.
_MORE: Final = (
    r"(?!(?:on|in|inside|under|by|near|beside|behind|at|next|not|no|never|now|moved|left|right|one)\b)"
    r"(?![a-z]+n't\b)[a-z']+"
)
_STANDING: Final = (
    r"(?:(?:that|which) (?:is|are) )?(?:just |still |currently )?"
    r"(?:lying|sitting|standing|charging|hiding|waiting|resting|kept|placed|left|sat|stood|located)"
    r"(?: about| around| there| over)? "
)
_PRAISE: Final = (
    r"favou?rite|trusty|lovely|nice|good|beautiful|precious|usual|fancy|cute|damn|damned|bloody|"
    r"blasted|silly|poor|dear|own|proper|pretty|"
    # What it is for, which is nothing to see.
    r"pop|cereal|breakfast|soup|salad|fruit|coffee|tea|beer|soda|coke|cola|water|juice|wine|milk|tennis|"
    r"toy|bouncy|rubber|car|house|door|office|telly|tv|television|cook|reading|story|school|library|"
    r"ceramic|plastic|wooden|metal|glass|paper|cardboard|shiny|empty|full"
)
_BUILT: Final = r"(?:low|small|little|big|large|wooden|round|square|long|wee|tiny)"
_ROWS: Final[tuple[tuple[str, str], ...]] = (
    (r"^something to (?:drink (?:from|out of)|put (?:my |a )?(?:drink|tea|coffee) in)$", "a cup"),
    (r"^something to drink$", "a drink"),
    (r"^something to read$", "a book"),
    (r"^something to play with$", "a ball"),
    (rf"(?<=\w) (?:that |which |who )?{_SOMEBODY}{_HAS} {_LAID} {_AT}", " "),
    (rf"(?<=\w) (?:that |which |who )?{_SOMEBODY}{_HAS} {_DID} {_AT}", " "),
    (rf"(?<=\w) (?:that |which |who )?{_SOMEBODY}{_HAS} {_DID}(?: {_MORE}){{0,3}}$", ""),
    (r" of (?:mine|ours|yours|hers|his|theirs)\b", ""),
    (r" from (?:earlier|before|yesterday|this morning|last night|just now)$", ""),
    (r" with (?:the|a|its) (?:handle|lid|label|stripes?|picture|logo|cap|straw|lettering)"
     r"(?: on (?:it|top))?$", ""),
    (rf"\b{_STANDING}{_AT}", ""),
    (rf"\b(?:{_PRAISE}) (?=(?!table\b|in\b|on\b)[a-z])", ""),
    (r"\bwee\b|\btiny\b", "small"),
    (rf"\b{_BUILT} (?=(?:table|desk|shelf|sideboard)\b)", ""),
)  # fmt: skip
_TABLE: Final = tuple((re.compile(pattern), instead) for pattern, instead in _ROWS)


def plain_description(text: str) -> str:
    """Return a description, in lower case, without what nobody can see in the thing."""
    for pattern, instead in _TABLE:
        text = pattern.sub(instead, text)
    return text
