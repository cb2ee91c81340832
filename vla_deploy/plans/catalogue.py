"""List every skill: its parameters, limits, resources and time-out, in one literal table."""

import math
from dataclasses import dataclass
from enum import Enum, StrEnum
from types import MappingProxyType

from vla_deploy.manipulation.grasps import GraspKind
from vla_deploy.world.relations import NEXT_TO
from vla_deploy.world.resting import IN, ON
from vla_deploy.world.vocabulary import OBJECT_CLASSES

ARMS = ("left", "right")
GRASPABLE_CLASSES = tuple(name for name in OBJECT_CLASSES if name != "box")
RELATIONS = (IN, ON, NEXT_TO)
# These skills move nothing.
MOTIONLESS = frozenset({"speak", "wait", "stop"})
# These skills switch a device of the home.
SWITCHING = frozenset({"turn_on", "turn_off"})


# Shares of what `pick_up` does by itself: hands never go faster than by feel. Half of the weakest
# grip is 17 N (0.125 of 1.6 N m at a pinion of 12 mm): two fingers of friction 0.5 carry 1.7 kg.
SPEED_RATIOS = (0.3, 1.0)
FORCE_RATIOS = (0.5, 1.3)


class SkillKind(StrEnum):
    """Name the kinds of skill by what they do; time-outs go by them."""

    NAVIGATION = "navigation"
    MANIPULATION = "manipulation"
    INTERACTION = "interaction"
    PERCEPTION = "perception"
    MOVEMENT = "movement"


DEFAULT_TIMEOUT_S = 60.0
NAVIGATION_TIMEOUT_S = 300.0
TIMEOUTS_S = MappingProxyType(
    {
        **dict.fromkeys(SkillKind, DEFAULT_TIMEOUT_S),
        SkillKind.NAVIGATION: NAVIGATION_TIMEOUT_S,
        SkillKind.MANIPULATION: 120.0,
    }
)


class Type(Enum):
    """Name the kinds of parameter that a skill takes."""

    NUMBER = "a number"
    TEXT = "a text"
    PLACE = "a known place"
    OBJECT = "a known kind of object, with a colour if it matters"
    DESTINATION = "a known object or a known place"
    DEVICE = "a known device of the home"
    CHOICE = "one of a list"
    FLAG = "true or false"


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillParameter:
    """Describe one parameter; numbers carry their range, choices their list."""

    type: Type
    required: bool = True
    minimum: float = -math.inf
    maximum: float = math.inf
    choices: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class SkillSpec:
    """Describe one skill; `one_of` names parameter groups of which exactly one must be given.

    `resources` are what no two skills use at a time; "arm" is the arm that the action names, and
    "device" the device. A robot that has none of what it `may_lack` can do it, too.
    """

    summary: str
    kind: SkillKind
    parameters: dict[str, SkillParameter]
    one_of: tuple[tuple[str, ...], ...] = ()
    resources: tuple[str, ...] = ()
    may_lack: frozenset[str] = frozenset()
    finds_way: bool = False
    """It takes a map, and a lidar to know the place on it."""
    own_timeout_s: float | None = None
    estimated_duration_s: float = 1.0
    retryable: bool = False

    @property
    def timeout_s(self) -> float:
        """Return how long an action may take: its own time-out, or that of its kind."""
        return TIMEOUTS_S[self.kind] if self.own_timeout_s is None else self.own_timeout_s


def _number(minimum: float, maximum: float, *, required: bool = True) -> SkillParameter:
    return SkillParameter(type=Type.NUMBER, required=required, minimum=minimum, maximum=maximum)


def _choice(*choices: str, required: bool = True) -> SkillParameter:
    return SkillParameter(type=Type.CHOICE, required=required, choices=choices)


_ARM = _choice(*ARMS, required=False)
_DEVICE = SkillParameter(type=Type.DEVICE)
_OBJECT = SkillParameter(type=Type.OBJECT)
_OBJECT_OR_ELSE = SkillParameter(type=Type.OBJECT, required=False)
# Without it the base cruises as fast as its robot file lets it.
_SPEED = _number(0.05, 2.0, required=False)
# An arm on a table, under a camera that stands fast.
_MOUNTED = frozenset({"base", "head"})

SKILLS: MappingProxyType[str, SkillSpec] = MappingProxyType(
    {
        "navigate_to": SkillSpec(
            kind=SkillKind.NAVIGATION,
            summary="drive to a named place, to where an object can be reached, or to a point",
            parameters={
                "place": SkillParameter(type=Type.PLACE, required=False),
                "object": _OBJECT_OR_ELSE,
                "x_m": _number(-100, 100, required=False),
                "y_m": _number(-100, 100, required=False),
                "yaw_rad": _number(-math.pi, math.pi, required=False),
                "speed_m_s": _SPEED,
            },
            one_of=(("place",), ("object",), ("x_m", "y_m")),
            resources=("base", "head", "camera", "arms"),
            finds_way=True,
            estimated_duration_s=15.0,
            retryable=True,
        ),
        "charge": SkillSpec(
            kind=SkillKind.NAVIGATION,
            summary="drive to the charging station, and see that the battery charges there",
            parameters={"place": SkillParameter(type=Type.PLACE, required=False)},
            resources=("base", "head", "camera", "arms"),
            finds_way=True,
            estimated_duration_s=20.0,
            retryable=True,
        ),
        "follow_person": SkillSpec(
            kind=SkillKind.NAVIGATION,
            summary="follow the person who walks nearby, for a while or until told otherwise",
            parameters={"duration_s": _number(0, 1800, required=False)},
            resources=("base", "head", "camera", "arms"),
            finds_way=True,
            own_timeout_s=2000.0,
            estimated_duration_s=60.0,
        ),
        "guard": SkillSpec(
            kind=SkillKind.NAVIGATION,
            summary="stand here or at a place, and report each person who comes in",
            parameters={
                "place": SkillParameter(type=Type.PLACE, required=False),
                "duration_s": _number(0, 1800, required=False),
            },
            resources=("base", "head", "camera", "arms"),
            finds_way=True,
            own_timeout_s=2200.0,
            estimated_duration_s=60.0,
        ),
        "inspect": SkillSpec(
            kind=SkillKind.NAVIGATION,
            summary="look at an object from two sides, and tell what was seen from each",
            parameters={"object": _OBJECT},
            resources=("base", "head", "camera", "arms"),
            finds_way=True,
            estimated_duration_s=30.0,
            retryable=True,
        ),
        "sweep": SkillSpec(
            kind=SkillKind.NAVIGATION,
            summary="drive over all the floor of a place, and tell which share was covered",
            parameters={"place": SkillParameter(type=Type.PLACE)},
            resources=("base", "head", "camera", "arms"),
            finds_way=True,
            own_timeout_s=1800.0,
            estimated_duration_s=150.0,
        ),
        "move": SkillSpec(
            kind=SkillKind.MOVEMENT,
            summary="drive straight, forward or (negative) backward",
            parameters={"distance_m": _number(-3, 3), "speed_m_s": _SPEED},
            resources=("base",),
            estimated_duration_s=4.0,
        ),
        "turn": SkillSpec(
            kind=SkillKind.MOVEMENT,
            summary="turn on the spot, counter-clockwise positive",
            parameters={"angle_rad": _number(-2 * math.pi, 2 * math.pi)},
            resources=("base",),
            estimated_duration_s=4.0,
        ),
        "look_at": SkillSpec(
            kind=SkillKind.PERCEPTION,
            summary="turn the head to an object or a direction",
            parameters={
                "object": _OBJECT_OR_ELSE,
                "direction": _choice("ahead", "left", "right", "up", "down", required=False),
            },
            one_of=(("object",), ("direction",)),
            resources=("head", "camera"),
            may_lack=frozenset({"head"}),
            estimated_duration_s=2.0,
        ),
        "find_object": SkillSpec(
            kind=SkillKind.PERCEPTION,
            summary="look for an object, from here and then from each viewpoint",
            parameters={"object": _OBJECT},
            resources=("base", "head", "camera", "arms"),
            may_lack=_MOUNTED,
            own_timeout_s=NAVIGATION_TIMEOUT_S,  # it drives from one viewpoint to the next
            estimated_duration_s=10.0,
            retryable=True,
        ),
        "pick_up": SkillSpec(
            kind=SkillKind.MANIPULATION,
            summary="grasp an object within reach and verify the grasp",
            parameters={
                "object": _OBJECT,
                "arm": _ARM,
                "grasp": _choice(*GraspKind, required=False),
                "careful": SkillParameter(type=Type.FLAG, required=False),
                "speed_ratio": _number(*SPEED_RATIOS, required=False),
                "force_ratio": _number(*FORCE_RATIOS, required=False),
            },
            resources=("base", "head", "camera", "arms"),
            may_lack=_MOUNTED,
            estimated_duration_s=15.0,
            retryable=True,
        ),
        "place": SkillSpec(
            kind=SkillKind.MANIPULATION,
            summary="put what is held in, on or next to something within reach",
            parameters={
                "destination": SkillParameter(type=Type.DESTINATION),
                "relation": _choice(*RELATIONS),
                "arm": _ARM,
            },
            resources=("base", "head", "camera", "arms"),
            may_lack=_MOUNTED,
            estimated_duration_s=12.0,
            retryable=True,
        ),
        "hand_over": SkillSpec(
            kind=SkillKind.MANIPULATION,
            summary="give a person what a hand holds: it opens when it feels a pull",
            parameters={"arm": _ARM},
            resources=("base", "arms", "speaker"),
            may_lack=_MOUNTED,
            estimated_duration_s=15.0,
        ),
        "open_gripper": SkillSpec(
            kind=SkillKind.MANIPULATION,
            summary="open a gripper, letting go of what it holds",
            parameters={"arm": _ARM},
            resources=("arm",),
            estimated_duration_s=2.0,
        ),
        "close_gripper": SkillSpec(
            kind=SkillKind.MANIPULATION,
            summary="close a gripper until it is shut or holds something",
            parameters={"arm": _ARM},
            resources=("arm",),
            estimated_duration_s=2.0,
        ),
        "move_arm": SkillSpec(
            kind=SkillKind.MANIPULATION,
            summary="bring the arms to a named pose of the robot file",
            parameters={"pose": SkillParameter(type=Type.TEXT), "arm": _ARM},
            resources=("arm",),
            estimated_duration_s=4.0,
        ),
        "speak": SkillSpec(
            kind=SkillKind.INTERACTION,
            summary="say a sentence",
            parameters={"text": SkillParameter(type=Type.TEXT)},
            resources=("speaker",),
            estimated_duration_s=1.0,
        ),
        "wait": SkillSpec(
            kind=SkillKind.INTERACTION,
            summary="do nothing for a while",
            parameters={"duration_s": _number(0, 600)},
            own_timeout_s=660.0,
            estimated_duration_s=5.0,
        ),
        **{
            f"turn_{state}": SkillSpec(
                kind=SkillKind.INTERACTION,
                summary=f"switch a device of the home {state}, and read back that it is",
                parameters={"device": _DEVICE},
                resources=("device",),
                own_timeout_s=30.0,
                estimated_duration_s=1.5,
                retryable=True,
            )
            for state in ("on", "off")
        },
        "stop": SkillSpec(
            kind=SkillKind.MOVEMENT,
            summary="bring the base and the arms to rest",
            parameters={},
            resources=("base", "head", "arms"),
            may_lack=frozenset({"base", "head", "arms"}),
            estimated_duration_s=1.0,
        ),
    }
)
