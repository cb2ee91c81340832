"""Find out where the robot is before it drives anywhere."""

import math

from drivers.clock import NS_PER_S
from vla_deploy.client.place_state import PlaceState
from vla_deploy.navigation.follower import AT_REST, Twist
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import TryAgain

# A lost robot searches the map at rest first; then a turn shows whether another view helps.
SEARCH_S = 6.0
SEARCH_TURN_RAD = 2.2 * math.pi
SEARCH_RATE_RAD_S = 0.5


def find_myself(context: SkillContext) -> Skill:
    """Wait until the robot knows where it is; where rest does not help, turn around on the spot.

    The base is round, so a turn takes no room that it does not stand on.

    Raises:
        TryAgain: it is still lost after a whole turn.
    """
    link = context.link
    yield from _search(context, AT_REST, SEARCH_S)
    if link.place_state is PlaceState.LOST:
        yield from _search(
            context, Twist(0.0, SEARCH_RATE_RAD_S), SEARCH_TURN_RAD / SEARCH_RATE_RAD_S
        )
    if link.place_state is PlaceState.LOST:
        raise TryAgain(
            f"I do not know where I am: {link.place_doubt}; turn me or push me a metre or two, "
            "best to where I have been before, and tell me again"
        )


def _search(context: SkillContext, twist: Twist, duration_s: float) -> Skill:
    """Make a motion for so long while the robot is lost, as far as control lets it."""
    end_ns = context.link.working_ns() + round(duration_s * NS_PER_S)
    while context.link.place_state is PlaceState.LOST and context.link.working_ns() < end_ns:
        context.link.drive(twist)
        yield
    context.link.drive(AT_REST)
