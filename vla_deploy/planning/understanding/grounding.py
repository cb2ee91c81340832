"""Ground a plan: referring expressions become ids, words or places, what is missing is put in.

One function for every planner: patterns, the command parser, language models, a person's own JSON.
Each may say "pick up it" and leave the way there out.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

from vla_deploy.planning.errors import NotAble
from vla_deploy.planning.interfaces import PlanRequest
from vla_deploy.planning.understanding import phrases
from vla_deploy.planning.understanding.fitting import ThingUse
from vla_deploy.planning.understanding.places import (
    Parameters,
    check_readable,
    destination_of,
    pose_parameters,
    pronoun_of,
    resolve_place,
    thing_unless_place,
)
from vla_deploy.planning.understanding.remembered import hand_to_take, place_to_look
from vla_deploy.planning.understanding.resolver import Referent, Resolver
from vla_deploy.plans.catalogue import SKILLS
from vla_deploy.plans.errors import PlanError, PlanInvalid, UnknownDevice, UnknownPlace
from vla_deploy.plans.knowledge import match_device
from vla_deploy.plans.plan import (
    MOST_ACTIONS,
    PUT_IN,
    Action,
    Plan,
    dependency_faults,
    execution_order,
)
from vla_deploy.plans.symbolic.conditions import MET, Setting, is_before, is_known
from vla_deploy.plans.symbolic.simulation import after, in_turn
from vla_deploy.plans.symbolic.state import (
    HeldSymbol,
    SymbolicState,
    state_of,
    subject_of,
    subject_or_none,
)
from vla_deploy.plans.symbolic.table import LOGIC
from vla_deploy.plans.validator import action_faults

LONGEST_ID: Final = 48
OTHER_FAILED: Final = "the other one could not take such a thing the last time"
# These skills want the robot before the thing, those only want it known.
FROM_CLOSE: Final = frozenset({"pick_up", "place"})
OF_THINGS: Final = frozenset({"navigate_to", "look_at", "inspect", *FROM_CLOSE})

Step = tuple[str, Parameters]


def ground_plan(plan: Plan, request: PlanRequest) -> Plan:
    """Return the plan as it can be validated and carried out; it names only what the robot knows.

    Raises:
        PlanInvalid: its ids are not unique, or its dependencies no order.
        UnknownObject: an expression names nothing that the robot knows.
        UnknownPlace: a place is not known.
        UnknownDevice: a device is not known.
        Ambiguous: only the speaker can tell what is meant.
    """
    faults = dependency_faults(plan.actions)
    if faults:
        raise PlanInvalid([], faults)
    grounder = _Grounder(request)
    for action in execution_order(plan.actions):
        try:
            grounder.add(action)
        except PlanError as error:
            error.action_id = action.id
            raise
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

    def __init__(self, request: PlanRequest) -> None:
        self.resolver = Resolver(request)
        self.done: list[Action] = []
        self._request = request
        self._state = state_of(request.world, request.scene, request.here)
        self._last: dict[str, tuple[str, ...]] = {}
        self._taken: set[str] = set()

    def add(self, action: Action) -> None:
        """Ground an action, with what must come before it, into none, one or several."""
        needed, earlier = self._now_called(action.depends_on), self._now_called(action.after)
        action = action.model_copy(update={"after": earlier})
        for skill, parameters in self._steps(action):
            step = _made(action, skill, parameters, "")
            if skill == action.skill:
                step = action.model_copy(update={"parameters": dict(parameters)})
            step = self._with_hand(step)
            needed = self._look_where_it_was(step, needed)
            for _ in ("a look", "a way"):  # each is done before the next is asked for
                missing = _missing(step, self._state, self._request)
                if missing is not None:
                    needed = self._append(_made(step, *missing), needed)
            needed = self._append(step, needed)
        self._last[action.id] = needed

    def _now_called(self, ids: tuple[str, ...]) -> tuple[str, ...]:
        """Return what actions of the proposal have become."""
        return tuple(dict.fromkeys(name for one in ids for name in self._last.get(one, (one,))))

    def _with_hand(self, step: Action) -> Action:
        """Name the hands when a second thing is taken: who puts down must know which is where."""
        state, wanted = self._state, step.parameters.get("arm")
        if step.skill == "pick_up":
            hand = hand_to_take(step.parameters, state, self._request)
            if hand:
                self.resolver.note(step.parameters["object"], f"for the {hand} hand", OTHER_FAILED)
                return _with_arm(step, hand)
        if step.skill != "pick_up" or len(state.held) != 1 or len(state.hands) < 2:
            return step
        first = state.held[0].hand or next(one for one in state.hands if one != wanted)
        if not state.held[0].hand:
            at = max(n for n, one in enumerate(self.done) if one.skill == "pick_up")
            self.done[at] = _with_arm(self.done[at], first)
            self._state = replace(state, held=(replace(state.held[0], hand=first),))
        return _with_arm(step, wanted or next(one for one in state.hands if one != first))

    def _look_where_it_was(self, step: Action, needed: tuple[str, ...]) -> tuple[str, ...]:
        """Go first to where a thing that is not in sight was seen in earlier runs."""
        place = place_to_look(step, self._state, self.done, self._request)
        if not place:
            return needed
        self.resolver.note(step.parameters["object"], f"sought at {place}", "it was there last")
        return self._append(_made(step, "navigate_to", {"place": place}), needed)

    def _append(self, action: Action, needed: tuple[str, ...]) -> tuple[str, ...]:
        """Add an action behind those that it needs; return what comes next needs."""
        name, number = action.id, 1
        while name in self._taken:
            number += 1
            name = f"{action.id[:LONGEST_ID]}_{number}"
        self._taken.add(name)
        action = _completed(action.model_copy(update={"id": name, "depends_on": needed}))
        self.done.append(action)
        if action.skill in LOGIC and not action_faults(action, self._request.world):
            self._state = after(action, self._state, self._request.world, self._request.scene)
        return (name,)

    # --- what the parameters of each skill refer to ---------------------------------------------

    def _steps(self, action: Action) -> Iterator[Step]:
        """Yield an action with what it refers to resolved: several for "both cups", none if done.

        Each step is carried out in the state before the next one is asked for.

        Raises:
            PlanError: what it refers to is not known, or must be asked.
        """
        given = action.parameters
        match action.skill:
            case "navigate_to":
                yield from self._navigate(given)
            case "charge":
                yield "charge", {"place": self._station(given.get("place"))}
            case "sweep" | "guard" if isinstance(given.get("place"), str):
                where = resolve_place(given["place"], self.resolver)
                yield action.skill, {**given, "place": where}
            case "place":
                yield from self._place(given)
            case "find_object" | "look_at" | "inspect" if isinstance(given.get("object"), str):
                thing = self.resolver.things(given["object"], ThingUse.SEE)[0]
                yield from _on_furniture(thing)
                yield action.skill, {**given, "object": thing.name}
            case "pick_up" if isinstance(given.get("object"), str):
                yield from self._pick(given)
            case "hand_over" if isinstance(given.get("object"), str):
                yield from self._hand_over(given)
            case "turn_on" | "turn_off" if isinstance(given.get("device"), str):
                yield action.skill, {**given, "device": self._device(given["device"])}
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
        thing = thing_unless_place(goal, self.resolver, ThingUse.REACH)
        if thing is None:
            yield "navigate_to", {"place": resolve_place(goal, self.resolver), **rest}
            return
        yield from _on_furniture(thing)
        yield "navigate_to", {"object": thing.name, **rest}

    def _station(self, said: object) -> str:
        """Return where the robot charges.

        Raises:
            NotAble: it has no place for that.
        """
        if isinstance(said, str):
            return resolve_place(said, self.resolver)
        station = self._request.world.station
        if not station:
            raise NotAble("I know no place where I can charge: [battery] station names it")
        return station

    def _device(self, text: str) -> str:
        devices = self._request.world.devices
        name = match_device(text, devices)
        if name is None:
            raise UnknownDevice(text, set(devices.values()))
        return name

    def _here(self, text: str) -> Parameters:
        here = self._request.here
        if here is None:
            raise UnknownPlace(text, set(self._request.world.places.values()))
        why = "where the command was given"
        self.resolver.note(text, f"{here[0]:.2f}, {here[1]:.2f}", why)
        return pose_parameters(here)

    def _pick(self, given: Parameters) -> Iterator[Step]:
        things = self.resolver.things(given["object"], ThingUse.TAKE)
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
            things = self.resolver.things(given["object"], ThingUse.PUT)
        destination = destination_of(given, self.resolver, self._state)
        if given.get("destination") is None:
            # What no hand holds is not fetched to put it down, and the plan may have put it before.
            is_empty = bool(self._state.hands) and not self._state.held
            things = tuple(one for one in things if (self._held(one) if one else not is_empty))
            if not (things or self._state.rests):
                raise PlanInvalid([f"no hand holds {given.get('object', 'anything')}"])
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
        for thing in self.resolver.things(given["object"], ThingUse.PUT):
            if self._held(thing) is None:
                yield from _on_furniture(thing)
                yield "pick_up", {"object": thing.name, **_arm(given)}
                if self._request.here is not None and "navigate_to" in self._request.world.skills:
                    yield "navigate_to", self._here("here")
            yield "hand_over", self._hand_of(self._held(thing)) or _arm(given)

    def _has_put(self, thing: Referent, destination: Parameters) -> bool:
        """Return whether the plan has put a thing there: "take it to the box, drop it in"."""
        rest = self._state.rests.get(self._key(thing))
        where = str(destination.get("destination", ""))
        subject = subject_or_none(where, self._request.scene)
        return rest is not None and rest.of in (where, where if subject is None else subject.key)

    def _hand_of(self, held: HeldSymbol | None) -> Parameters:
        """Name the hand that holds a thing where another holds something, too."""
        is_named = held is not None and held.hand and len(self._state.held) > 1
        return {"arm": held.hand} if held is not None and is_named else {}

    def _held(self, thing: Referent) -> HeldSymbol | None:
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


def _missing(action: Action, state: SymbolicState, request: PlanRequest) -> Step | None:
    """Return the first step that a plan leaves out before an action: a look, or a way."""
    if action.skill not in OF_THINGS:
        return None
    setting = Setting(parameters=action.parameters, world=request.world, scene=request.scene)
    subject = setting.subject("object") or setting.subject("destination")
    name = action.parameters.get("object", action.parameters.get("destination"))
    if subject is not None and is_known(state, setting) != MET:
        return "find_object", {"object": name}
    can_drive = "navigate_to" in request.world.skills
    if action.skill in FROM_CLOSE and can_drive and is_before(state, setting) != MET:
        return "navigate_to", {"object" if subject is not None else "place": name}
    return None


def _with_arm(action: Action, arm: str) -> Action:
    return action.model_copy(update={"parameters": {**action.parameters, "arm": arm}})


def _made(
    action: Action, skill: str, parameters: Mapping[str, Any], description: str = PUT_IN
) -> Action:
    """Return an action that comes before another, of the same priority."""
    return Action(
        id=f"{action.id[:40]}_{skill}",
        skill=skill,
        parameters=dict(parameters),
        after=action.after,
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
            "estimated_duration_s": action.estimated_duration_s or spec.estimated_duration_s,
        }
    )
