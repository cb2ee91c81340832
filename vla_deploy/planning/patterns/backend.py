"""Plan the commonest commands at once: each clause fits a whole pattern, or nothing is planned."""

import re
from collections.abc import Mapping
from string import digits
from typing import Final

from vla_deploy.client.action_words import skill_words
from vla_deploy.memory import EpisodeOutcome, Judgement, read_judgement
from vla_deploy.planning.builders.steps import Steps, pose_named
from vla_deploy.planning.command_parser.grammar import Step
from vla_deploy.planning.errors import CannotBeDone, Declined, NotUnderstood
from vla_deploy.planning.interfaces import BackEnd, PlanRequest, Proposal
from vla_deploy.planning.patterns.follow_up import repeated
from vla_deploy.planning.patterns.phrase import clauses, parts_of
from vla_deploy.planning.patterns.table import PATTERNS, is_thing
from vla_deploy.planning.prohibitions import proposal_of, read_order
from vla_deploy.planning.scope import scope_words
from vla_deploy.planning.understanding import TurnOutcome
from vla_deploy.planning.understanding.grounding import ground_plan
from vla_deploy.plans.errors import UnknownDevice, UnknownPlace
from vla_deploy.plans.knowledge import World, match_devices, match_place
from vla_deploy.plans.plan import Plan, Skill, chained
from vla_deploy.runtime.deadline import Deadline

NAME: Final = "patterns"
_CALLED_POSE: Final = re.compile(r"\b(?:pose|posture)\b")
_THERE: Final = frozenset({"here", "there", "over there", "back there"})


class Patterns(BackEnd):
    """Plan what the table of patterns covers, the same every time."""

    name = NAME

    def propose(self, request: PlanRequest, deadline: Deadline) -> Proposal:
        """Return the plan; a pattern fits or it does not, so there is no doubt about it.

        Raises:
            Declined: a clause fits none.
            PlanError: what a clause asks for cannot be done.
        """
        del deadline  # it takes no time
        if request.failed:
            raise Declined("patterns know words, not what was done of them")
        order = read_order(request.text, request.world, request.prohibitions)
        if order is not None:
            return proposal_of(order, request, self.name)
        judgement = read_judgement(request.text)
        if judgement is not None:
            plan = _answered(judgement, request)
            return Proposal(plan=plan, back_end=self.name, confidence=1.0, covers=None)
        plan = pattern_plan(request)
        # Around the slots there are no words that change anything.
        return Proposal(plan=plan, back_end=self.name, confidence=1.0, covers=None)


def _answered(judgement: Judgement, request: PlanRequest) -> Plan:
    """Return what the robot says to a judgement of the last command; the memory keeps it.

    Raises:
        CannotBeDone: there is no memory, or no command that has ended.
    """
    if not request.experience.has_memory:
        raise CannotBeDone("I keep no memory of what I was told, so I cannot correct it")
    turns = [one for one in request.conversation.turns if read_judgement(one.said) is None]
    if not turns or turns[-1].outcome is TurnOutcome.UNDER_WAY:
        raise CannotBeDone("no command has ended yet that this could be about")
    words = "I will remember that this was right."
    if judgement.outcome is not EpisodeOutcome.SUCCEEDED:
        words = "Sorry. I will remember that this was wrong."
    skills: list[Skill] = [("speak", {"text": words})]
    return Plan(goal=request.text.strip(), summary=words, actions=chained(skills))


def pattern_plan(request: PlanRequest) -> Plan:
    """Return the plan of a command that patterns cover.

    Raises:
        Declined: a clause fits none.
        PlanError: what a clause asks for cannot be done, or there is nothing to repeat.
    """
    said = clauses(request.text)
    plan = repeated(said[0], request) if len(said) == 1 else None
    if plan is not None:
        return plan
    if not said:
        raise Declined("no clause that a pattern covers")
    skills = [
        skill
        for clause in said
        for skill in Steps(clause.split(), request).skills(_fitting(clause, request))
    ]
    return Plan(goal=request.text.strip(), summary=skill_words(skills), actions=chained(skills))


def plan_command(text: str, world: World, here: tuple[float, float, float] | None = None) -> Plan:
    """Plan a command by patterns alone, grounded in what is known.

    `here` is the robot's x, y (m) and yaw (rad) in the map, to which "bring me" returns.

    Raises:
        NotUnderstood: no pattern covers a clause.
        PlanError: what a clause asks for cannot be done, or is not known.
    """
    request = PlanRequest(command_id="", text=text, world=world, here=here)
    try:
        return ground_plan(pattern_plan(request), request)
    except Declined as error:
        raise NotUnderstood(text, world) from error


def _fitting(clause: str, request: PlanRequest) -> Step:
    unknown = no_device = ""
    for pattern, given in PATTERNS:
        found = pattern.fullmatch(clause)
        if found is None:
            continue
        said = {name.rstrip(digits): text for name, text in found.groupdict().items() if text}
        named = [said[name] for name in ("where", "from") if name in said]
        devices = parts_of(said.get("device", ""))
        if not _is_pose(said, given, clause, request):
            continue
        if not all(match_devices(one, request.world) for one in devices):
            no_device = said["device"] if clause.startswith(("turn ", "switch ")) else ""
            continue
        if all(_is_known(one, request) for one in named):
            return {**given, **said}
        unknown = unknown or ("" if "what" in said else said.get("where", ""))
    if unknown and not scope_words(clause):
        raise UnknownPlace(unknown, set(request.world.places.values()))
    if no_device and request.world.devices and not scope_words(clause):
        raise UnknownDevice(no_device, set(request.world.devices.values()))
    raise Declined(f'no pattern covers "{clause[:60]}"')


def _is_pose(said: Step, given: Mapping[str, str], clause: str, request: PlanRequest) -> bool:
    """Return whether a clause about a pose names one; what is called a pose is refused by name."""
    if "name" not in said or "name" in given:
        return True
    known = pose_named(said["name"], request.world.poses) is not None
    return known or _CALLED_POSE.search(clause) is not None


def _is_known(name: str, request: PlanRequest) -> bool:
    """Return whether words name a place, or a thing, or are "there"."""
    return name in _THERE or is_thing(name) or match_place(name, request.world.places) is not None
