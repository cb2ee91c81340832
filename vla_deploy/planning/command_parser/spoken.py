"""Read what the fields of an answer say, in the words of the command that they were copied from."""

import re
from collections.abc import Sequence
from typing import Final

from vla_deploy.planning.builders import steps as building
from vla_deploy.planning.command_parser.grammar import Step
from vla_deploy.planning.command_parser.wording import find_span
from vla_deploy.planning.errors import PlanInvalid
from vla_deploy.planning.interfaces import Request
from vla_deploy.planning.references import match_place
from vla_deploy.planning.understanding.furniture import is_surface
from vla_deploy.planning.understanding.quantities import (
    UNITS,
    amount_of,
    amount_words,
    is_silent,
)
from vla_deploy.world.vocabulary import CONTAINERS, SYNONYMS

Skill = building.Step
_POSSESSIVES: Final = re.compile(r"\b(?:his|her|their|its)\b")
# What was copied beside a thing: "(get) a grip of (the red book)", "(what became) of the phone".
_BESIDE: Final = re.compile(r"^(?:(?:an? )?(?:grip|hold|grasp|ahold|rid) )?(?:of|about) ")


class Spoken:
    """Hold a command, and read what steps that answer it refer to."""

    def __init__(self, command: Sequence[str], request: Request) -> None:
        self._command = command
        self._request = request

    @property
    def request(self) -> Request:
        """Return what the command came with."""
        return self._request

    def says(self, word: str) -> bool:
        """Tell whether a word was said."""
        return word in self._command

    def spoken(self, step: Step, field: str) -> str:
        """Return the words of a field, with the articles that were said among them."""
        words = step[field].split()
        span = find_span(words, self._command)
        text = " ".join(words if span is None else span.spoken)
        text = _BESIDE.sub("", _POSSESSIVES.sub("the", text))
        return re.sub(
            r"\b(on|to|at|in) (left|right|middle|back|front)\b(?! of)", r"\1 the \2", text
        )

    def source(self, step: Step) -> tuple[list[Skill], str]:
        """Return the way to the room where things are, or words that say what they are on or in."""
        where = self._where_from(step)
        if not where:
            return [], ""
        world = self._request.world
        place = match_place(where, world.places)
        if place is not None and not is_surface(place, world):
            there = f" in {where}"
            if self._is_seen(step, there):
                return [], there
            return [("navigate_to", {"place": place})], ""
        kinds = {SYNONYMS.get(word, word) for word in where.split()}
        return [], f" {'in' if kinds & CONTAINERS else 'on'} {where}"

    def things(self, step: Step) -> tuple[list[Skill], str]:
        """Return the way to what a step is about, and that, with where it is to be taken from."""
        way, behind = self.source(step)
        return way, " and ".join(part + behind for part in self.parts(step))

    def parts(self, step: Step) -> list[str]:
        """Return each thing that a step is about, without where it is to be taken from."""
        spoken, _, _ = self._chosen(step).partition(" from ")
        if "except" in step:
            return [f"{spoken} but {self.spoken(step, 'except')}"]
        return building.parts_of(spoken)

    def _chosen(self, step: Step) -> str:
        """Return what a step is about: of two choices the second where only that is seen."""
        first = self.spoken(step, "what")
        second = self.spoken(step, "else") if "else" in step else ""
        is_second = bool(second) and not building.is_seen(first, self._request)
        return second if is_second and building.is_seen(second, self._request) else first

    def _is_seen(self, step: Step, there: str) -> bool:
        """Tell whether each thing of a step is known to be at a place."""
        parts = self.parts(step)
        return bool(parts) and all(building.is_seen(one + there, self._request) for one in parts)

    def _where_from(self, step: Step) -> str:
        """Return "the kitchen" of "the cup from the kitchen", or of a field of its own."""
        if "from" in step:
            return self.spoken(step, "from")
        return self.spoken(step, "what").partition(" from ")[2] if "what" in step else ""

    def amount(self, step: Step, dimension: str, default: float) -> float:
        """Return the amount of a step in SI units; a bare number is one of degrees, not radians.

        Raises:
            PlanInvalid: its words are no amount.
        """
        words = step["by"].split() if "by" in step else []
        units = UNITS[dimension]
        bare = units["degree"] if dimension == "rad" else 1.0
        # More may have been copied than the amount.
        for told in (words, amount_words(words, units)):
            if told and (value := amount_of(told, units, bare)) is not None:
                return value
        if is_silent(words):
            return default
        raise PlanInvalid([f'"{step["by"]}" is no amount that I know'])
