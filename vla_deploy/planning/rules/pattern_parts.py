"""Name the parts that patterns of rules are made of, and what a rule is."""

import re
from dataclasses import dataclass
from typing import Final

from vla_deploy.planning.rules.building import Builder
from vla_deploy.planning.rules.intents import Intent
from vla_deploy.planning.understanding.quantities import NUMBER

Row = tuple[Intent, str, Builder]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """Hold one row; a clause that fits `pattern` whole is built by `build`."""

    intent: Intent
    pattern: re.Pattern[str]
    build: Builder


OBJECT: Final = r"(?P<object>.+?)"
PLACE: Final = r"(?P<place>.+)"
SAID_OF: Final = (
    r"(?P<object>(?:the|that|this|my) (?:\w+ ){1,2}you are holding|"
    r"(?:the|my|our|this|that|these|those|both|all)"
    r"(?: (?!you\b|i\b|we\b|should\b|must\b|has to\b|needs to\b)[\w']+){1,8}?|it|they|that|this)"
)
METRES: Final = (
    rf"(?P<quantity>{NUMBER}(?: of a| an?)? ?(?:m|meters?|metres?|cm|centimeters?|centimetres?|"
    r"feet|foot|steps?|paces?|inch|inches))"
)
ANGLE: Final = rf"(?P<quantity>{NUMBER} ?(?:degrees?|deg|°|rad|radians?))"
SECONDS: Final = (
    rf"(?P<quantity>{NUMBER}(?: of a| an?)? ?(?:seconds?|secs?|s|minutes?|mins?|moment))"
)
WAY: Final = r"(?P<way>forwards?|ahead|straight(?: ahead| on)?|backwards?|back(?: up)?|in reverse)"
LITTLE: Final = (
    r"(?:a (?:little|(?:wee |tiny |little )?(?:bit|tad|touch|smidge(?:n)?|hair|fraction|notch|"
    r"tick))|slightly|an inch or (?:two|so)|a couple of inches|ever so slightly)"
)
ROLL: Final = r"(?:shuffle|scoot|shift|nudge|inch|edge|creep|slide|budge|ease|crawl|nip|hop)"
SIDE: Final = r"(?P<way>left|right|a?round|clockwise|counter-?clockwise|anti-?clockwise)"
SHARE: Final = (
    r"(?:an? |one )?(?P<share>half|(?:three[ -])?quarters?|full|whole|complete)(?: an?| of an?)?"
)
HAND: Final = r"(?:the |your |a )?(?:(?P<arm>left|right) )?(?:grippers?|hands?|fingers|claws?)"
INTO: Final = (
    r"(?P<relation>(?:back )?(?:into|inside of|inside|in|onto|on top of|on|to|at|over to|upon))"
)
