"""Pick an object up: see it afresh, choose a grasp, take it, feel it, lift it, feel again."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from vla_deploy.manipulation.grasps import GraspKind, raised
from vla_deploy.plans.knowledge import parse_object
from vla_deploy.robots import RobotDescription
from vla_deploy.skills.actions.navigate import solve_near
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import (
    NotHeld,
    NotPossible,
    NotThere,
    OutOfReach,
    SkillFailed,
    Touched,
    TryAgain,
)
from vla_deploy.skills.movements.arms import (
    feel,
    feel_way,
    lift,
    move_straight,
    move_to_posture,
    set_opening,
)
from vla_deploy.skills.movements.carrying import carry, or_carry
from vla_deploy.skills.movements.frames import to_base
from vla_deploy.skills.movements.gaze import kept_in_sight, remembered
from vla_deploy.skills.movements.grasp_choice import GraspChoice, choose_grasp, kinds_for
from vla_deploy.skills.movements.motion import pause
from vla_deploy.world import Query
from vla_deploy.world.vocabulary import ANY_CLASS

APPROACH_SPEED_RATIO = 0.5
STRAIGHT_SPEED_RATIO = 0.35
# The fingers are sent this much past the surface they should meet.
SQUEEZE_M = 0.012
MOST_TOUCHES = 3
CAREFUL_SPEED: Final = 0.5
CAREFUL_FORCE: Final = 0.8


@dataclass(frozen=True, slots=True, kw_only=True)
class Handling:
    """Say how a thing is handled: shares of the usual speed to it and force on it."""

    speed_ratio: float = 1.0
    force_ratio: float = 1.0

    @classmethod
    def of(cls, parameters: Mapping[str, Any]) -> "Handling":
        """Read the parameters of `pick_up`; `careful` is slower and less hard than either says."""
        is_careful = bool(parameters.get("careful"))
        speed, force = (CAREFUL_SPEED, CAREFUL_FORCE) if is_careful else (1.0, 1.0)
        return cls(
            speed_ratio=speed * float(parameters.get("speed_ratio", 1.0)),
            force_ratio=force * float(parameters.get("force_ratio", 1.0)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """Say what is taken, by which hands, and how."""

    query: Query
    hands: Sequence[str]
    handling: Handling


def pick_up(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Grasp an object within reach, verified by the fingers' opening and effort.

    Raises:
        NotPossible: no hand is free, or none reaches the object.
        TryAgain: it was not seen, or the grasp did not hold.
    """
    query = parse_object(parameters["object"])
    if _already_held(context, query):
        return
    wanted = Wanted(
        query=query,
        hands=_free_hands(context, parameters.get("arm")),
        handling=Handling.of(parameters),
    )
    yield from carry(context)
    if "grasp" in parameters:
        kinds: tuple[GraspKind, ...] = (GraspKind(parameters["grasp"]),)
    else:
        kinds = kinds_for(context, remembered(context, query))
    yield from _take_somehow(context, wanted, kinds)


def _take_somehow(context: SkillContext, wanted: Wanted, kinds: Sequence[GraspKind]) -> Skill:
    """Take a thing by the first kind of grasp that does it.

    Raises:
        SkillFailed: none does; what the first of those said that got to the thing.
        NotPossible: one has failed, and the thing is gone.
    """
    failures: list[SkillFailed] = []
    for kind in kinds:
        try:
            yield from _take_so(context, wanted, kind)
            return
        except (NotPossible, NotHeld, Touched) as error:
            failures.append(error)
            if kind is kinds[-1] or any(context.hands.get(hand) for hand in wanted.hands):
                break
            yield from context.take_all_again()
        except NotThere as error:
            if not failures:
                raise
            raise NotPossible(f"{failures[0]}, and {error}") from error
        except TryAgain:
            if not failures:
                raise
            break
    raise next((one for one in failures if isinstance(one, TryAgain)), failures[0])


def _take_so(context: SkillContext, wanted: Wanted, kind: GraspKind) -> Skill:
    """Take a thing by a kind of grasp; where the hand meets it, look again and take another."""
    met: list[float] = []
    while True:
        choose = partial(_choose, context, wanted, kind, met)
        choice = yield from solve_near(context, wanted.query, choose)
        context.keep_only(choice.hand)
        try:
            yield from or_carry(context, _grasp(context, choice, wanted), choice.hand)
            break
        except Touched:
            yield from context.take_all_again()
            met.append(choice.grasp.yaw_rad)
            if len(met) == MOST_TOUCHES:
                raise
    context.tell(arm=choice.hand, **{"class": choice.held.kind})
    yield from carry(context, (choice.hand,))


def _grasp(context: SkillContext, choice: GraspChoice, wanted: Wanted) -> Skill:
    is_side = choice.grasp.kind is GraspKind.SIDE
    notes = [f"with the {choice.hand} hand"] if len(context.robot.hands) > 1 else []
    notes += ["from the side"] if is_side else []
    if notes:
        context.note(", ".join(notes))
    yield from _approach(context, choice, wanted.handling)
    yield from _take(context, choice, wanted)


def _approach(context: SkillContext, choice: GraspChoice, handling: Handling) -> Skill:
    """Bring the open fingers around the object; where they meet something, bring them back.

    Raises:
        Touched: the fingers met something on their way, and are at its beginning again.
    """
    grasp, hand, speed_ratio = choice.grasp, choice.hand, handling.speed_ratio
    yield from set_opening(context, hand, grasp.opening_m)
    yield from move_to_posture(context, hand, choice.above, speed_ratio * APPROACH_SPEED_RATIO)
    for place, pose in enumerate(choice.way):
        try:
            yield from feel_way(context, hand, pose, speed_ratio)
        except Touched:
            yield from _draw_back(context, choice, place)
            yield from move_to_posture(context, hand, choice.above, STRAIGHT_SPEED_RATIO)
            raise


def _draw_back(
    context: SkillContext, choice: GraspChoice, place: int, above_m: float = 0.0
) -> Skill:
    """Bring the open fingers back to where the way's piece to that place began, or above that."""
    if place > 0:
        back = raised(choice.way[place - 1], above_m)
        with suppress(OutOfReach):  # the arm is raised next, wherever it is
            yield from move_straight(context, choice.hand, back, STRAIGHT_SPEED_RATIO)


def _take(context: SkillContext, choice: GraspChoice, wanted: Wanted) -> Skill:
    """Close, feel, lift, feel again; open when nothing is held."""
    grasp, hand = choice.grasp, choice.hand
    goal_m = max(grasp.width_m - 2 * SQUEEZE_M, 0.004)
    effort_ratio = wanted.handling.force_ratio * grasp.effort_ratio
    yield from set_opening(context, hand, goal_m, effort_ratio)
    touch, lifted_m = feel(context, hand, goal_m), 0.0
    if touch.holds(effort_ratio):
        context.hands[hand], lifted_m = choice.held, choice.lift_m
        yield from lift(context, hand, lifted_m)
        yield from pause(context, 0.3)
        touch = feel(context, hand, goal_m)
        if touch.holds(effort_ratio):
            if choice.out is not None:
                yield from move_straight(context, hand, choice.out, STRAIGHT_SPEED_RATIO)
            return
    context.hands[hand] = None
    yield from set_opening(context, hand, grasp.opening_m)
    yield from _draw_back(context, choice, len(choice.way) - 1, lifted_m)
    raise NotHeld(
        f"the {hand} hand does not hold the {wanted.query}: fingers "
        f"{touch.opening_m * 1000:.0f} mm apart "
        f"(expected {grasp.width_m * 1000:.0f}), effort {touch.effort_ratio:.2f}"
    )


def _already_held(context: SkillContext, query: Query) -> bool:
    """Return whether a hand holds what is meant: by the scene, or by kind where it cannot tell.

    An id means one thing, and no other of its kind.
    """
    scene = context.link.snapshot()
    full = {hand: held for hand, held in context.hands.items() if held is not None}
    if scene is not None and any(one.held_by in full for one in query.among(scene)):
        return True
    known = {one.held_by for one in scene.things} if scene is not None else set()
    wanted = (query.kind, query.colour)
    return not query.thing_id and any(
        wanted in ((held.kind, held.colour), (held.kind, ""))
        for hand, held in full.items()
        if hand not in known
    )


def _free_hands(context: SkillContext, wanted: str | None) -> list[str]:
    free = [name for name in context.robot.hands if context.hands.get(name) is None]
    if wanted is not None:
        free = [name for name in free if name == wanted]
    if not free:
        full = ", ".join(f"{name}: {held.kind}" for name, held in context.hands.items() if held)
        raise NotPossible(f"no hand is free ({full}); put something down first")
    return free


def _choose(
    context: SkillContext, wanted: Wanted, kind: GraspKind, met: Sequence[float]
) -> GraspChoice:
    """Return the plainest of the reachable grasps of that kind.

    Raises:
        TryAgain: the object is out of sight.
        OutOfReach: no hand gets there.
        NotPossible: its size is not known, no hand opens so far, or it is not grasped so.
    """
    seen = kept_in_sight(context, wanted.query)
    centre = to_base(context.link.pose, seen["position_m"])
    require_known_height(context.robot, str(seen["class"]), centre)
    return choose_grasp(context, seen, wanted.hands, kind, met)


def require_known_height(robot: RobotDescription, kind: str, centre_m: Sequence[float]) -> None:
    """Refuse what a camera without depth sees and cannot tell the height of.

    Raises:
        NotPossible: nothing of known size has its outline.
    """
    if kind == ANY_CLASS and not robot.camera.has_depth:
        raise NotPossible(
            f"how high the {kind} at {centre_m[0]:.2f}, {centre_m[1]:.2f} m is, is not known: the "
            "camera has no depth, and no [[things]] of the robot file has its outline; add its size"
        )
