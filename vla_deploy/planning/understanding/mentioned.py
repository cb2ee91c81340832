"""Tell what a plan is about, so that the next command can say "it", "there" and "the other one"."""

from collections.abc import Iterator
from typing import Final

from vla_deploy.planning.errors import UnknownObject
from vla_deploy.planning.plan import Action, Plan
from vla_deploy.planning.references import words_of
from vla_deploy.planning.symbolic.state import Subject, subject_of
from vla_deploy.planning.understanding.conversation import Mention, Role
from vla_deploy.world import Snapshot
from vla_deploy.world.vocabulary import ANY_CLASS, COLOURS, OBJECT_CLASSES, SYNONYMS

MOST_LETTERS: Final = 400
_ROLES: Final = {"object": Role.OBJECT, "destination": Role.DESTINATION, "place": Role.PLACE}


def mentions_of(plan: Plan, scene: Snapshot | None) -> tuple[Mention, ...]:
    """Return what a grounded plan names, in its order, each once."""
    found: dict[tuple[str, str], Mention] = {}
    for action in plan.actions:
        for mention in (*_put_from_hand(action, plan, scene), *_mentions(action, plan, scene)):
            found.setdefault((mention.means, mention.thing_id), mention)
    return tuple(found.values()) or _told(plan, scene)


def _told(plan: Plan, scene: Snapshot | None) -> tuple[Mention, ...]:
    """Return what a plan that only answers is about: the one thing that it tells of, if it does."""
    asked = tuple(_spoken(plan.goal, scene))
    told = {
        one.thing_id: one
        for action in plan.actions
        if isinstance(action.parameters.get("text"), str)
        for one in _spoken(str(action.parameters["text"]), scene)
        if one.thing_id
    }
    return tuple(told.values()) if len(told) == 1 else asked


def _spoken(goal: str, scene: Snapshot | None) -> Iterator[Mention]:
    """Yield the things that a command names whose plan only answers it: "where is my phone?"."""
    colour = ""
    for word in words_of(goal[:MOST_LETTERS]):
        name = SYNONYMS.get(word, word)
        if name in OBJECT_CLASSES and name != ANY_CLASS:
            subject = subject_of(f"{colour} {name}", scene)
            yield _mention(word, subject, Role.OBJECT)
        colour = name if name in COLOURS else ""


def _mentions(action: Action, plan: Plan, scene: Snapshot | None) -> Iterator[Mention]:
    for name, role in _ROLES.items():
        value = action.parameters.get(name)
        if not isinstance(value, str):
            continue
        role = _role(value, role, plan)
        try:
            subject = subject_of(value, scene)
        except UnknownObject:
            yield Mention(said=value, means=value, role=Role.PLACE)
            continue
        yield _mention(value, subject, role)


def _put_from_hand(action: Action, plan: Plan, scene: Snapshot | None) -> Iterator[Mention]:
    """Yield what a plan puts down that the hand had before; its actions do not name it."""
    if action.skill != "place" or scene is None:
        return
    arm = action.parameters.get("arm")
    taken = any(one.skill == "pick_up" for one in plan.actions[: plan.actions.index(action)])
    held = [one for one in scene.things if one.held_by and arm in (None, one.held_by)]
    if len(held) == 1 and not taken:
        yield Mention.of(held[0], held[0].thing_id)


def _mention(said: str, subject: Subject, role: Role) -> Mention:
    if subject.thing is not None:
        return Mention.of(subject.thing, said, role)
    return Mention(said=said, means=subject.words, role=role, kind=subject.kind)


def _role(value: str, role: Role, plan: Plan) -> Role:
    """Return the part that a name plays in the whole plan: what is driven to, to put, is put to."""
    put_to = any(one.parameters.get("destination") == value for one in plan.actions)
    return Role.DESTINATION if put_to else role
