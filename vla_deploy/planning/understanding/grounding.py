"""Ground a plan: referring expressions become ids, words or places, what is missing is put in.

One function for every planner: patterns, the command parser, language models, a person's own JSON.
Each may say "pick up it" and leave the way there out; what they say too much is left out.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, Final

from vla_deploy.planning.catalogue import SKILLS
from vla_deploy.planning.errors import PlanInvalid, UnknownObject, UnknownPlace
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.knowledge import World
from vla_deploy.planning.plan import (
    MOST_ACTIONS,
    PUT_IN,
    Action,
    Plan,
    dependency_faults,
    execution_order,
)
from vla_deploy.planning.symbolic.conditions import MET, Setting, has_free_hand, is_before, is_known
from vla_deploy.planning.symbolic.simulation import after, in_turn
from vla_deploy.planning.symbolic.state import Held, State, state_of, subject_of
from vla_deploy.planning.symbolic.table import LOGIC
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.fitting import Use
from vla_deploy.planning.understanding.normaliser import normalised
from vla_deploy.planning.understanding.places import (
    Parameters,
    check_readable,
    destination_of,
    pose_parameters,
    pronoun_of,
    resolve_place,
    thing_unless_place,
)
from vla_deploy.planning.understanding.resolver import Referent, Resolver
from vla_deploy.planning.validator import action_faults

# A free hand takes two steps, then the thing is looked for and driven to.
MOST_INSERTED: Final = 6
LONGEST_ID: Final = 48
# Doing these a second time at once changes nothing.
IDEMPOTENT: Final = frozenset(
    {"navigate_to", "look_at", "find_object", "open_gripper", "close_gripper", "move_arm", "stop"}
)
# These skills want the robot before the thing, those only want it known.
FROM_CLOSE: Final = frozenset({"pick_up", "place"})
OF_THINGS: Final = frozenset({"navigate_to", "look_at", *FROM_CLOSE})

Step = tuple[str, Parameters]


def ground_plan(plan: Plan, request: Request) -> Plan:
    """Return the plan as it can be validated and carried out; it names only what the robot knows.

    Raises:
        PlanInvalid: its dependencies are no order.
        UnknownObject: an expression names nothing that the robot knows.
        UnknownPlace: a place is not known.
        Ambiguous: only the speaker can tell what is meant.
    """
    actions = _with_unique_ids(plan.actions)
    faults = dependency_faults(actions)
    if faults:
        raise PlanInvalid(faults)
    grounder = _Grounder(request)
    for action in execution_order(actions):
        grounder.add(action)
    if len(grounder.done) > MOST_ACTIONS:
        raise PlanInvalid([f"it would need {len(grounder.done)} actions, {MOST_ACTIONS} at most"])
    texts = (plan.reasoning, *dict.fromkeys(grounder.resolver.reasons))
    update = {
        "actions": in_turn(tuple(grounder.done)),
        "reasoning": "; ".join(text for text in texts if text),
    }
    return plan.model_copy(update=update)


class _Grounder:
    """Ground one action after another, keeping the state that those before it leave."""

    def __init__(self, request: Request) -> None:
        self.resolver = Resolver(request)
        self.done: list[Action] = []
        self._request = request
        self._state = state_of(request.world, request.scene, request.here)
        self._last: dict[str, tuple[str, ...]] = {}
        self._taken: set[str] = set()

    def add(self, action: Action) -> None:
        """Ground an action, with what must come before it, into none, one or several."""
        action = normalised(action, self._request.world.poses)
        needed = tuple(
            dict.fromkeys(name for one in action.depends_on for name in self._last.get(one, (one,)))
        )
        for skill, parameters in self._steps(action):
            step = _made(action, skill, parameters, "")
            if skill == action.skill:
                step = action.model_copy(update={"parameters": dict(parameters)})
            step = self._with_hand(step)
            for missing in self._missing_before(step):
                needed = self._append(_made(step, *missing), needed)
            needed = self._append(step, needed)
        self._last[action.id] = needed

    def _with_hand(self, step: Action) -> Action:
        """Name the hands when a second thing is taken: who puts down must know which is where."""
        held = self._state.held
        if step.skill != "pick_up" or len(held) != 1 or len(self._state.hands) < 2:
            return step
        arm = held[0].hand
        if not arm:
            arm = next(one for one in self._state.hands if one != step.parameters.get("arm"))
            self._name_hand(arm)
        other = next(one for one in self._state.hands if one != arm)
        arm = step.parameters.get("arm", other)
        return step.model_copy(update={"parameters": {**step.parameters, "arm": arm}})

    def _name_hand(self, arm: str) -> None:
        """Let the latest thing taken be in that hand."""
        at = max(n for n, one in enumerate(self.done) if one.skill == "pick_up")
        taken = self.done[at]
        parameters = {**taken.parameters, "arm": arm}
        self.done[at] = taken.model_copy(update={"parameters": parameters})
        held = tuple(replace(one, hand=arm) for one in self._state.held)
        self._state = replace(self._state, held=held)

    def _missing_before(self, step: Action) -> Iterator[Step]:
        """Yield what must still come before a step; each is done before the next is asked for."""
        for _ in range(MOST_INSERTED):
            missing = _missing(step, self._state, self._request)
            if missing is None:
                return
            yield missing

    def _append(self, action: Action, needed: tuple[str, ...]) -> tuple[str, ...]:
        """Add an action behind those that it needs; return what comes next needs."""
        if self._is_needless(action):
            return needed
        name = _free_id(action.id, self._taken)
        self._taken.add(name)
        action = _completed(action.model_copy(update={"id": name, "depends_on": needed}))
        self.done.append(action)
        if action.skill in LOGIC and not action_faults(action, self._request.world):
            self._state = after(action, self._state, self._request.world, self._request.scene)
        return (name,)

    def _is_needless(self, action: Action) -> bool:
        """Tell whether the action before it has just done the same."""
        if action.skill not in IDEMPOTENT or not self.done:
            return False
        before = self.done[-1]
        return (before.skill, before.parameters) == (action.skill, action.parameters)

    # --- what the parameters of each skill refer to ---------------------------------------------

    def _steps(self, action: Action) -> Iterator[Step]:
        """Yield an action with what it refers to resolved: several for "both cups", none if done.

        Each step is carried out in the state before the next one is asked for.

        Raises:
            PlanningError: what it refers to is not known, or must be asked.
        """
        given = action.parameters
        match action.skill:
            case "navigate_to":
                yield from self._navigate(given)
            case "place":
                yield from self._place(given)
            case "find_object" | "look_at" if isinstance(given.get("object"), str):
                thing = self.resolver.things(given["object"], Use.SEE)[0]
                yield from _on_furniture(thing)
                yield action.skill, {**given, "object": thing.name}
            case "pick_up" if isinstance(given.get("object"), str):
                yield from self._pick(given)
            case "hand_over" if isinstance(given.get("object"), str):
                yield from self._hand_over(given)
            case _:
                yield action.skill, given

    def _navigate(self, given: Parameters) -> Iterator[Step]:
        rest = {name: value for name, value in given.items() if name not in ("place", "object")}
        goal = given.get("place", given.get("object"))
        if not isinstance(goal, str) or ("place" in given and "object" in given):
            yield "navigate_to", given
            return
        if pronoun_of(goal) == phrases.HERE:
            yield "navigate_to", {**self._here(goal), **rest}
            return
        thing = thing_unless_place(goal, self.resolver, Use.REACH)
        if thing is None:
            yield "navigate_to", {"place": resolve_place(goal, self.resolver), **rest}
            return
        yield from _on_furniture(thing)
        yield "navigate_to", {"object": thing.name, **rest}

    def _here(self, text: str) -> Parameters:
        here = self._request.here
        if here is None:
            raise UnknownPlace(text, set(self._request.world.places.values()))
        why = "where the command was given"
        self.resolver.note(text, f"{here[0]:.2f}, {here[1]:.2f}", why)
        return pose_parameters(here)

    def _pick(self, given: Parameters) -> Iterator[Step]:
        things = self.resolver.things(given["object"], Use.TAKE)
        if pronoun_of(given["object"]) == phrases.THEM:
            # "Put the cups down, get the keys": what the plan has put somewhere is not meant.
            others = [one for one in things if self._key(one) not in self._state.rests]
            things = tuple(others) or things
        for thing in things:
            if self._held(thing) is None:
                yield from _on_furniture(thing)
                yield "pick_up", {**given, "object": thing.name}

    def _place(self, given: Parameters) -> Iterator[Step]:
        put = {name: value for name, value in given.items() if name != "object"}
        things: tuple[Referent | None, ...] = (None,)
        check_readable(given.get("destination"), self.resolver)
        if isinstance(given.get("object"), str):
            things = self.resolver.things(given["object"], Use.PUT)
        destination = destination_of(given, self.resolver, self._state)
        if given.get("destination") is None:
            things = self._to_put_down(things)
        for thing in things:
            if thing is not None and self._held(thing) is None:
                if self._has_put(thing, destination):
                    continue
                yield from _on_furniture(thing)
                yield "pick_up", {"object": thing.name, **_arm(given)}
            held = None if thing is None else self._held(thing)
            yield "place", {**put, **destination, **self._hand_of(held)}

    def _hand_over(self, given: Parameters) -> Iterator[Step]:
        """Give what is held; what is not is fetched before, to where it was asked for."""
        things = list(self.resolver.things(given["object"], Use.PUT))
        while things:
            missing = [one for one in things if self._held(one) is None]
            fetched = missing[: max(1, self._state.free_hands())]
            for thing in fetched:
                yield from _on_furniture(thing)
                yield "pick_up", {"object": thing.name, **_arm(given)}
            if fetched and self._request.here is not None:
                yield "navigate_to", self._here("here")
            in_hand = [one for one in things if self._held(one) is not None]
            for thing in in_hand or fetched:
                yield "hand_over", self._hand_of(self._held(thing)) or _arm(given)
                things.remove(thing)

    def _has_put(self, thing: Referent, destination: Parameters) -> bool:
        """Tell whether the plan has put a thing there: "take it to the box, drop it in"."""
        rest = self._state.rests.get(self._key(thing))
        where = str(destination.get("destination", ""))
        if rest is None or rest.of == where:
            return rest is not None
        with suppress(UnknownObject):  # a place by another name
            return rest.of == subject_of(where, self._request.scene).key
        return False

    def _to_put_down(self, things: tuple[Referent | None, ...]) -> tuple[Referent | None, ...]:
        """Return what of things is in a hand; nothing where the plan has put them down already.

        Raises:
            PlanInvalid: none of them is, and the plan has not had it.
        """
        state = self._state
        in_hand = {self._held(one) if one else None: one for one in things}
        held = tuple(one for where, one in in_hand.items() if one is None or where is not None)
        if things == (None,) and state.hands and not state.held and state.rests:
            return ()
        if not held and not any(self._key(one) in state.rests for one in things if one):
            raise PlanInvalid([f"no hand holds the {things[0].words}" if things[0] else "nothing"])
        return held

    def _hand_of(self, held: Held | None) -> Parameters:
        """Name the hand that holds a thing where another holds something, too."""
        is_named = held is not None and held.hand and len(self._state.held) > 1
        return {"arm": held.hand} if held is not None and is_named else {}

    def _held(self, thing: Referent) -> Held | None:
        """Return the holding of a thing, which without a scene goes by its kind, or its hand."""
        keys = (self._key(thing), thing.kind)
        called = (one for one in self._state.held if one.key in keys)
        return next((one for one in called if thing.hand in ("", one.hand)), None)

    def _key(self, thing: Referent) -> str:
        return subject_of(thing.name, self._request.scene).key


def _arm(given: Parameters) -> Parameters:
    return {"arm": given["arm"]} if "arm" in given else {}


def _on_furniture(thing: Referent) -> Iterator[Step]:
    """Go first to the furniture on which an unseen thing was said to be."""
    if thing.look_at:
        yield "navigate_to", {"place": thing.look_at}


def _missing(action: Action, state: State, request: Request) -> Step | None:
    """Return the first step that a plan leaves out before an action: a look, a way, a free hand."""
    if action.skill not in OF_THINGS:
        return None
    setting = Setting(parameters=action.parameters, world=request.world, scene=request.scene)
    if action.skill == "pick_up" and has_free_hand(state, setting):
        return _towards_free_hand(action, state, request.world)
    subject = setting.subject("object") or setting.subject("destination")
    name = action.parameters.get("object", action.parameters.get("destination"))
    if subject is not None and is_known(state, setting) != MET:
        return "find_object", {"object": name}
    if action.skill in FROM_CLOSE and is_before(state, setting) != MET:
        return "navigate_to", {"object" if subject is not None else "place": name}
    return None


def _towards_free_hand(action: Action, state: State, world: World) -> Step | None:
    """Put down what a hand holds, on the nearest furniture; None where there is none."""
    table = world.nearest_surface(state.spot)
    arm = action.parameters.get("arm")
    held = next((one for one in state.held if arm in (None, one.hand)), None)
    if table is None or held is None:
        return None
    if state.at != table:
        return "navigate_to", {"place": table}
    put = {"destination": table, "relation": "on"}
    return "place", {**put, "arm": held.hand} if held.hand else put


def _made(
    action: Action, skill: str, parameters: Mapping[str, Any], description: str = PUT_IN
) -> Action:
    """Return an action that comes before another, of the same priority."""
    name = f"{action.id[:40]}_{skill}"
    return Action(
        id=name,
        skill=skill,
        parameters=dict(parameters),
        priority=action.priority,
        description=description,
    )


def _completed(action: Action) -> Action:
    """Fill in from the tables what the author of an action left out."""
    spec, logic = SKILLS.get(action.skill), LOGIC.get(action.skill)
    if spec is None or logic is None:
        return action
    return action.model_copy(
        update={
            "resources": spec.resources,
            "preconditions": action.preconditions or tuple(logic.needs),
            "effects": action.effects or logic.leaves,
            "estimated_duration_s": action.estimated_duration_s or spec.estimated_duration_s,
        }
    )


def _with_unique_ids(actions: Sequence[Action]) -> tuple[Action, ...]:
    """Give each action an id of its own; who depends on a doubled id means the latest before it."""
    taken: set[str] = set()
    latest: dict[str, str] = {}
    unique = []
    for action in actions:
        depends_on = tuple(latest.get(one, one) for one in action.depends_on)
        name = _free_id(action.id, taken)
        taken.add(name)
        latest[action.id] = name
        unique.append(action.model_copy(update={"id": name, "depends_on": depends_on}))
    return tuple(unique)


def _free_id(wanted: str, taken: set[str]) -> str:
    """Return an id like the wanted one that is not taken."""
    if wanted not in taken:
        return wanted
    number = 2
    while f"{wanted[:LONGEST_ID]}_{number}" in taken:
        number += 1
    return f"{wanted[:LONGEST_ID]}_{number}"
