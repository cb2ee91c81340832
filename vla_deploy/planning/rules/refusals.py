"""List what people ask of a robot and this one cannot do, each with its reason."""

import re
from typing import Final

from vla_deploy.planning.errors import NotAble

_SWITCH: Final = "I cannot switch anything: this robot declares no device"
_CLEAN: Final = (
    "I have no brush, cloth or water; I can put things away (tidy up) or drive over the floor "
    "(patrol)"
)
REFUSALS: Final[tuple[tuple[re.Pattern[str], str], ...]] = tuple(
    (re.compile(pattern), reason)
    for pattern, reason in (
        (r"(?:turn|switch|power|shut) (?:on|off) .+|(?:turn|switch|power) .+ (?:on|off)", _SWITCH),
        (r"(?:activate|deactivate|dim|start|light|enable|disable) the .+", _SWITCH),
        (r"(?:turn|switch) (?:up|down) .+|(?:turn|switch) .+ (?:up|down)", _SWITCH),
        (r"(?:wipe|mop|vacuum|hoover|scrub|dust|wash|polish|rinse|brush)\b.*", _CLEAN),
        (r"(?:follow|come with|accompany|guide|lead|escort) .+",
         "I cannot follow or lead people: I know places, not where you go"),
        (r"(?:open|close|shut|lock|unlock) (?:the |a |my )?(?:door|drawer|fridge|refrigerator|"
         r"window|cupboard|cabinet|oven|microwave|dishwasher|bottle|can|box|lid|curtains?|gate)\b.*",
         "I cannot open or close that: my hands only take things from above"),
        (r"(?:pour|cook|bake|boil|fry|chop|cut|stir|make (?:me )?(?:a |some )?(?:coffee|tea|food|"
         r"dinner|lunch|breakfast|sandwich))\b.*", "I cannot prepare food or pour"),
        (r"(?!(?:throw|toss|chuck|sling|bung|lob|fling) [^,;.!?]+? (?:in|into) (?:the|my|that) "
         r"(?:\w+ )?(?:box|bowl)(?: for (?:me|us|him|her))?$)"
         r"(?:throw|toss|fling|hurl|chuck|lob|sling|bung|kick|smash|break|crush|hit|punch|"
         r"push|shove|stab|attack)\b.*"
         r"(?:\bat\b|\bout\b|\boff\b|\baway\b|\bdown the\b|\bme\b|\bhim\b|\bher\b|\bsomeone\b|"
         r"\bperson\b|\bpeople\b|\bdog\b|\bcat\b|\bchild\b|\bbaby\b|\bwall\b|\bwindow\b).*",
         "I do not throw or hit; I can put it somewhere"),
        (r"(?:put|place|set|lay|leave|drop|move) .+ (?:behind|"
         r"in front of(?! (?:you|me|us)$)|under|underneath|between|(?:to the )?(?:left|right) of) "
         r"(?!.*\b(?:in|into|on|onto|inside|to)\b).+",
         "I put things in, on or next to something, not under, behind or before it"),
        (r"(?:carry|lift|move|push|pull|drag|shift|bring|take|pick up|raise|turn over) "
         r"(?:up )?(?:the|that|this|my|our|your) (?:(?!off\b|from\b|on\b|in\b|to\b)\w+ "
         r"){0,2}(?:table|sofa|couch|bed|chair|"
         r"armchair|desk|shelf|cupboard|wardrobe|fridge|bookcase|furniture)"
         r"(?: (?:up|over|away|out|closer|nearer|(?:in)?to|across|from|for|with|by)\b.*)?",
         "furniture is too large and heavy for me"),
        (r"(?:climb|go (?:up|down) the (?:stairs|steps)|jump|fly|swim)\b.*",
         "I have wheels: I stay on the floor"),
    )
)  # fmt: skip


def refuse_unable(text: str) -> None:
    """Refuse what is known to be beyond the robot.

    Raises:
        NotAble: it is; says why and what it can do instead.
    """
    for pattern, reason in REFUSALS:
        if pattern.fullmatch(text):
            raise NotAble(reason)
