"""Carry what skills work with: link, kinematics, map, and what the hands hold."""

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.control.judging.body_shapes import BodyShapes
from vla_deploy.devices import HomeDevices
from vla_deploy.ipc import Announcer, ClaimBook
from vla_deploy.manipulation.kinematics import ArmKinematics
from vla_deploy.navigation.path_planning import PathPlanner
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.skills.errors import NotPossible
from vla_deploy.skills.link import SkillLink
from vla_deploy.skills.ros_goals import RosGoals

BASE: Final = "base"
Skill = Generator[None, None, None]
"""A skill yields once per executor step, returns on success, raises SkillFailed otherwise."""

Rest = Callable[[], Mapping[str, float]]
"""Return the parameters of what is left to do; raise TryAgain where nobody tells the pose."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
    """Say what a hand holds and how it is held.

    `below_grip_m` is how far the object reaches below the grip point while it is upright, as it
    was when taken: the hand is then tilted by `tilt_rad` from straight down (`hand_at`).
    """

    kind: str
    colour: str
    width_m: float
    below_grip_m: float
    tilt_rad: float = 0.0


@dataclass(slots=True, kw_only=True)
class SkillContext:
    """Carry everything a skill may use; `hands` is the executor's memory of each hand.

    `say` shows a text, `voice` has it heard; `notes` are what results say beside their status,
    `data` what came of actions; `rests` what is left of relative motions, all by actor;
    `needs` are the parts that each holder claims for the whole of its action;
    `way_m` are the points of the path that the base follows, (n, 2) in the map, none while it
    follows none. `holder` is the claim of the acting action, `ros` the way to servers beyond the
    robot, where the robot file names any. `keeps_out` are the places that the plan may not enter,
    `devices` those of the home that are switched. `out_of_reach` are the things that the base found
    no place to take them from, by id, with when that was, ns; `looked` is when each viewpoint's
    furniture was last looked at, ns. `shapes` are the robot's, once a way has been judged by them.
    """

    robot: RobotDescription
    link: SkillLink
    planner: PathPlanner
    arms: Mapping[str, ArmKinematics]
    say: Callable[[str], None]
    voice: Announcer
    claims: ClaimBook
    hands: dict[str, Held | None] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)
    data: dict[str, dict[str, Any]] = field(default_factory=dict)
    rests: dict[str, Rest] = field(default_factory=dict)
    way_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2)))
    holder: str = ""
    ros: RosGoals | None = None
    keeps_out: frozenset[str] = frozenset()
    devices: HomeDevices | None = None
    needs: dict[str, Mapping[str, int]] = field(default_factory=dict)
    out_of_reach: dict[str, int] = field(default_factory=dict)
    looked: dict[Pose2D, int] = field(default_factory=dict)
    shapes: BodyShapes | None = None

    def keep_only(self, hand: str) -> None:
        """Leave all but the base and one arm, with its hand, to others for a phase of the action.

        The base stands still meanwhile. What is left is taken back by `take_all_again`.
        """
        described = self.robot.hands[hand]
        kept = {BASE, described.arm, *self.robot.groups_moving((described.gripper,))}
        wants = {
            part: count for part, count in self.needs.get(self.holder, {}).items() if part in kept
        }
        self.claims.amend(self.holder, wants)

    def has_all(self) -> bool:
        """Take back what a phase has left to others; return whether the action has all it needs."""
        return self.claims.widen(self.holder, self.needs.get(self.holder, {}))

    def take_all_again(self) -> "Skill":
        """Wait until the acting action has every part of the robot again that it needs."""
        while not self.has_all():
            yield

    def note(self, text: str) -> None:
        """Have the result of the acting action say something, whatever its status."""
        self.notes[self.link.acting] = text

    def tell(self, **data: Any) -> None:
        """Have the result of the acting action tell what came of it."""
        self.data.setdefault(self.link.acting, {}).update(data)

    def may_go_on(self, rest: Rest) -> None:
        """Have what is left of the acting action told, should it end before it is done."""
        self.rests[self.link.acting] = rest

    def holding_hand(self, wanted: str | None = None) -> str:
        """Return the hand that holds something.

        Raises:
            NotPossible: no hand does, or not the one wanted.
        """
        for name, held in self.hands.items():
            if held is not None and wanted in (None, name):
                return name
        which = f"the {wanted} hand" if wanted else "neither hand"
        raise NotPossible(f"{which} holds anything; pick something up first")


def spoken(place: str) -> str:
    """Return the name of a place as it is said."""
    return place.replace("_", " ")


SkillFunction = Callable[[SkillContext, Mapping[str, Any]], Skill]
