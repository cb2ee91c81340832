"""List what documents call each skill, what they call its parameters, and what those become.

A parameter that this robot has no use for is a row, too: its value is reported as not used, with
the reason. What is in no row is passed on, and the validator refuses it by name.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Final

from vla_deploy.plans.catalogue import RELATIONS
from vla_deploy.plans.dialects import grips, values
from vla_deploy.plans.dialects.values import NotMeant, Read, ValueReading, unused

DESCRIPTOR: Final = "(descriptor)"
"""The parameter under which words about a thing are kept until its name is known."""
DIRECTIONS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "ahead": "ahead", "forward": "ahead", "front": "ahead", "straight": "ahead",
        "left": "left", "right": "right", "up": "up", "down": "down", "floor": "down",
    }
)  # fmt: skip
_VIEWS: Final = frozenset(
    {"current view", "view", "here", "current area", "anywhere", "everywhere"}
)


@dataclass(frozen=True, slots=True)
class ParameterForm:
    """Say what documents call a parameter, and how its value is read.

    It is `of_way` where it says where to go before the skill begins.
    """

    names: tuple[str, ...]
    read: Read
    of_way: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionForm:
    """Say what documents call an action, its skill, and the forms of its parameters.

    `default` holds what a document means that leaves it out.
    """

    names: tuple[str, ...]
    skill: str
    parameters: tuple[ParameterForm, ...] = ()
    default: Mapping[str, Any] = field(default_factory=dict)
    note: str = ""

    def parameter(self, name: str) -> ParameterForm | None:
        """Return the form of a parameter that goes by a name, None where there is none."""
        return next((one for one in self.parameters if name in one.names), None)


def _search_area(value: Any) -> ValueReading:
    """Read where to look first; the rest of the home is looked at after that."""
    everywhere = "looked at first, then every other viewpoint"
    taken = values.goal("place")(value)
    if str(taken.parameters.get("place", "")).lower() in _VIEWS:
        return ValueReading({}, everywhere)
    return ValueReading(taken.parameters, taken.note or everywhere)


def _looked_at(value: Any) -> ValueReading:
    said = values.spoken(value, "a thing or one of ahead, left, right, up, down; not a point")
    direction = DIRECTIONS.get(said.lower())
    return ValueReading({"object": said} if direction is None else {"direction": direction})


def _placement(value: Any) -> ValueReading:
    said = values.spoken(value, "a text such as on, in, next to")
    if said in RELATIONS:
        return ValueReading({"relation": said})
    return ValueReading({}, "not used, what is put down is lowered by feel onto free room")


def _inspection(value: Any) -> ValueReading:
    if values.words(value).lower() not in ("visual", "camera"):
        raise NotMeant('"visual": this robot inspects things with its camera only')
    return ValueReading({}, "is how it looks at things")


_Form = ParameterForm
_THING: Final = ("object", "target_object", "object_type", "object_name", "object_id", "item")
_OBJECT: Final = _Form((*_THING, "target"), values.thing())
_DESCRIPTOR: Final = _Form(("object_descriptor",), values.thing(DESCRIPTOR))
_ARM: Final = _Form(("arm", "hand"), values.text("arm"))
_SPEED: Final = _Form(("speed_m_s", "speed"), values.speed)
_ARM_SPEED: Final = _Form(
    ("speed",), unused("the arms move as their limits in the robot file let them")
)
_MARGIN: Final = _Form(("safety_margin",), values.margin)
_APPROACH: Final = _Form(
    ("approach_direction",), unused("where the robot stands is chosen by the map and by its reach")
)
_GRASP: Final = _Form(
    ("grasp_type", "grasp_position"),
    unused("the grasp is chosen by the kind, size and place of the thing as it is seen"),
)
_CAREFUL: Final = _Form(
    ("careful",), unused("the hands always go down by feel, and rest at a touch")
)
_FORCE: Final = _Form(("force",), unused("the grip is as firm as the table of grasps says"))
_DURATION: Final = _Form(("duration_s", "duration", "seconds", "time", "timeout"), values.duration)
_WAYS: Final = ("place", "location", "destination", "target_location", "target_position",
                "position", "coordinates", "room", "goal")  # fmt: skip
_TO: Final = (
    _Form((*_WAYS, "target"), values.goal("place")),
    _Form(_THING, values.thing()),
    _Form(("pose",), values.pose),
    *(_Form((f"{axis}_m", axis), values.number(f"{axis}_m", "a number of m")) for axis in "xy"),
    _Form(("yaw_rad", "yaw", "theta"), values.yaw),
    _DESCRIPTOR, _SPEED, _APPROACH, _MARGIN,
)  # fmt: skip
_HAND: Final = (_ARM, _ARM_SPEED, _GRASP, _CAREFUL, _FORCE, _APPROACH, _MARGIN)
_TAKE: Final = (
    _ARM,
    _Form(("grasp", "grasp_type"), grips.kind_of_grasp),
    _Form(("grasp_position",), unused("the thing is taken where it is seen")),
    _Form(("approach_direction",), grips.way_in),
    _Form(("careful",), grips.careful),
    _Form(("speed_ratio", "speed"), grips.share_of_speed),
    _Form(("force_ratio", "force"), grips.share_of_force),
    _MARGIN,
)
_PUT: Final = (
    _Form((*_WAYS, "container", "surface", "target"), values.goal("destination")),
    _Form(_THING, values.thing()),
    _Form(("relation",), values.text("relation")),
    _Form(("placement_type",), _placement),
    _DESCRIPTOR, *_HAND,
)  # fmt: skip
_LOOK: Final = (
    _Form((*_THING, "target", "target_position"), _looked_at),
    _Form(("direction",), _looked_at),
    _DESCRIPTOR,
)
_SEARCH: Final = (
    _OBJECT,
    _DESCRIPTOR,
    _Form(("search_area", "area"), _search_area, of_way=True),
    _Form(("search_method",), unused("it looks from here, then from one viewpoint after another")),
    _Form(("max_search_time", "search_radius", "scan_radius"), unused(
        "it looks from every viewpoint within the time-out of find_object")),
)  # fmt: skip
_DEVICE: Final = (_Form(("device", "target", "object", "target_object"), values.text("device")),)


def _moved(sign: float, opposite: str) -> tuple[ParameterForm, ...]:
    return (_Form(("distance_m", "distance"), values.distance_ahead(sign, opposite)), _SPEED)


def _turned(sign: float, opposite: str) -> tuple[ParameterForm, ...]:
    return (
        _Form(("angle", "angle_deg", "degrees"), values.angle_towards(sign, opposite)),
        _Form(("angle_rad",), values.radians(sign)),
    )


_QUARTER_RAD: Final = math.pi / 2
_FORMS: Final = (
    ActionForm(names=("navigate_to", "navigate", "go_to", "move_to", "navigation"),
               skill="navigate_to", parameters=_TO),
    ActionForm(names=("search_and_navigate", "approach_object"),
               skill="navigate_to", parameters=(_OBJECT, *_TO)),
    ActionForm(names=("charge", "recharge", "dock"), skill="charge",
               parameters=(_Form(("place", "station", "location"), values.text("place")),)),
    ActionForm(names=("follow_person", "follow"), skill="follow_person",
               parameters=(_DURATION,)),
    ActionForm(names=("guard", "watch", "monitor"), skill="guard", parameters=(
        _Form(("place", "area", "location", "room"), values.text("place")), _DURATION)),
    ActionForm(names=("sweep", "execute_cleaning", "cover_area"), skill="sweep", parameters=(
        _Form(("place", "area", "location", "room"), values.text("place")),
        _Form(("coverage_type",), unused("it drives in lanes, and then to what they have left")),
    )),
    ActionForm(names=("move",), skill="move",
               parameters=(_Form(("distance_m", "distance"), values.distance), _SPEED)),
    ActionForm(names=("move_forward",), skill="move", default={"distance_m": 1.0},
               parameters=_moved(1.0, "move_backward")),
    ActionForm(names=("move_backward",), skill="move", default={"distance_m": -1.0},
               parameters=_moved(-1.0, "move_forward")),
    ActionForm(names=("turn", "rotate"), skill="turn", default={"angle_rad": _QUARTER_RAD},
               parameters=(_Form(("angle", "angle_deg", "degrees"), values.angle),
                           _Form(("angle_rad",), values.radians()))),
    ActionForm(names=("turn_left",), skill="turn", default={"angle_rad": _QUARTER_RAD},
               parameters=_turned(1.0, "turn_right")),
    ActionForm(names=("turn_right",), skill="turn", default={"angle_rad": -_QUARTER_RAD},
               parameters=_turned(-1.0, "turn_left")),
    ActionForm(names=("pick_up", "pick", "grasp", "grab", "take", "grasp_object"),
               skill="pick_up", parameters=(_OBJECT, _DESCRIPTOR, *_TAKE)),
    ActionForm(names=("place", "place_down", "put_down", "put", "put_away", "release", "drop",
                      "navigate_to_place"),
               skill="place", parameters=_PUT),
    ActionForm(names=("hand_over", "handover", "give"), skill="hand_over",
               parameters=(_OBJECT, _DESCRIPTOR, *_HAND)),
    ActionForm(names=("find_object", "detect_object", "search", "search_for_object"),
               skill="find_object", parameters=_SEARCH),
    ActionForm(names=("look_at", "look"), skill="look_at", parameters=_LOOK),
    ActionForm(names=("inspect", "examine"), skill="inspect", parameters=(
        _Form((*_THING, "target", "target_position"), values.thing()), _DESCRIPTOR,
        _Form(("inspection_type",), _inspection), _APPROACH, _MARGIN)),
    ActionForm(names=("open_gripper",), skill="open_gripper", parameters=(_ARM, _FORCE)),
    ActionForm(names=("close_gripper",), skill="close_gripper", parameters=(_ARM, _FORCE)),
    ActionForm(names=("move_arm",), skill="move_arm",
               parameters=(_Form(("pose",), values.text("pose")), _ARM, _ARM_SPEED)),
    ActionForm(names=("speak", "say"), skill="speak", parameters=(
        _Form(("text", "message", "speech", "text_to_speak"), values.text("text")),)),
    ActionForm(names=("wait",), skill="wait", parameters=(_DURATION,)),
    ActionForm(names=("listen",), skill="wait", parameters=(_DURATION,),
               default={"duration_s": 5.0}, note="it waits for that long; the robot listens all "
               "the time, and what is said is a command of its own"),
    ActionForm(names=("turn_on", "activate"), skill="turn_on", parameters=_DEVICE),
    ActionForm(names=("turn_off", "deactivate"), skill="turn_off", parameters=_DEVICE),
)  # fmt: skip
FORMS: Final[Mapping[str, ActionForm]] = MappingProxyType(
    {name: form for form in _FORMS for name in form.names}
)
_CLEANING: Final = "execute_cleaning looks, plans its lanes and drives them: write that alone"
REFUSED: Final[Mapping[str, str]] = MappingProxyType(
    {
        **dict.fromkeys(("scan_cleaning_area", "plan_cleaning_path"), _CLEANING),
        **dict.fromkeys(
            ("manipulation", "interaction", "perception", "movement"),
            "this is a kind of action, not one; name it under action, such as pick_up",
        ),
    }
)
"""What no skill does, and what to write instead."""


def form_of(name: str) -> ActionForm:
    """Return the form of an action; of what no document names, its parameters as they are."""
    return FORMS.get(name) or ActionForm(names=(name,), skill=name)
