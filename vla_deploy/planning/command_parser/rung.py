"""Plan by the embedded command parser: the last back end, after any larger model.

Its mistakes do not show in their form, so each answer is weighed: what is unsure is read back and
waits for a yes, of what is very unsure there is no plan.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from platforms import ModelChoice
from vla_deploy.client.action_words import skill_words
from vla_deploy.inference.errors import InferenceError, ModelMismatch
from vla_deploy.inference.language_model import AnswerBounds, LanguageModel, open_language_model
from vla_deploy.inference.manifest import Certainty, LanguageUse
from vla_deploy.inference.memory_claims import MemoryClaim
from vla_deploy.inference.store import StoredModel
from vla_deploy.planning.builders.steps import Steps
from vla_deploy.planning.command_parser.certainty import (
    Oddities,
    confidence_of,
    features_of,
    oddities_of,
)
from vla_deploy.planning.command_parser.grammar import COPIED_FIELDS, Step, answer_schema
from vla_deploy.planning.command_parser.wording import (
    MOST_COMMAND_WORDS,
    asks_about_speaker,
    copied_spans,
    foreign_share,
    plain_words,
)
from vla_deploy.planning.errors import CannotBeDone, Declined
from vla_deploy.planning.interfaces import BackEnd, PlanRequest, Proposal
from vla_deploy.planning.prohibitions import order_of, proposal_of
from vla_deploy.planning.scope import WORDS, ScopeGroup
from vla_deploy.plans.plan import Plan, chained
from vla_deploy.runtime.deadline import Deadline
from vla_deploy.runtime.one_line import one_line

NAME: Final = "command_parser"
KNOWN_WORDS: Final = "known_words.txt"
MOST_FOREIGN: Final = 0.2
# A model that nobody has measured is asked back about everything.
UNMEASURED: Final = Certainty(
    bias=0.0, least=0.0, mean=0.0, strange=0.0, read_back_below=1.0, decline_below=0.0
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Parsed:
    """Hold what the model made of a command, and how sure that is."""

    words: tuple[str, ...]
    steps: tuple[Step, ...]
    confidence: float
    features: dict[str, float]
    oddities: Oddities


class CommandParser(BackEnd):
    """Hold the model and the words that it was shown."""

    name = NAME

    def __init__(self, model: LanguageModel, known_words: frozenset[str]) -> None:
        """Take an open model.

        Raises:
            ModelMismatch: it is no command parser.
        """
        if model.language.use is not LanguageUse.COMMAND_PARSER:
            raise ModelMismatch(NAME, (f"language.use: expected {LanguageUse.COMMAND_PARSER}",))
        self.model = model
        self.claim = MemoryClaim()
        self._known = known_words
        self._weights = model.language.certainty or UNMEASURED

    def propose(self, request: PlanRequest, deadline: Deadline) -> Proposal:
        """Return the plan that a command means, which is read back where that is unsure.

        Raises:
            Declined: it is no command, none that can be planned, or too unsure.
            PlanError: what it asks for cannot be done; says why.
        """
        if request.failed:
            raise Declined("I read words, not what was done of them: I would begin anew")
        try:
            parsed = self.parse(request.text, deadline)
        except InferenceError as error:
            raise Declined(one_line(error)) from error
        reader = Steps(parsed.words, request)
        if len(parsed.steps) == 1 and parsed.steps[0]["do"] in ("forbid", "permit"):
            step = parsed.steps[0]
            said = reader.fields(step, "what", "where").values()
            return proposal_of(order_of(said, step["do"] == "forbid", request), request, NAME)
        skills = [skill for step in parsed.steps for skill in reader.skills(step)]
        if asks_about_speaker(parsed.words) and not all("what" in step for step in parsed.steps):
            # "Can I have the cup?" wants it brought; what names no thing wants nothing of a robot.
            raise Declined("it asks about the one who speaks")
        awaits_word = parsed.steps[0]["do"] == "await"
        if any(step["do"] == "await" for step in parsed.steps[1:]):
            raise CannotBeDone(
                "I wait for a word only before I begin; say the rest when it is time"
            )
        plan = Plan(goal=request.text.strip(), summary=skill_words(skills), actions=chained(skills))
        sure, uncovered, covers = parsed.confidence, parsed.oddities.uncovered, _covered(parsed)
        if request.heard_confidence is not None:
            sure = min(sure, request.heard_confidence)
        if sure < self._weights.decline_below:
            raise Declined(f"I am not sure of it ({sure:.2f})")
        return Proposal(
            plan=plan,
            back_end=self.name,
            confidence=round(sure, 3),
            is_unsure=sure < self._weights.read_back_below or bool(uncovered),
            left_out=tuple(word for word in uncovered if word not in covers),
            covers=covers,
            awaits_word=awaits_word,
        )

    def parse(self, text: str, deadline: Deadline) -> Parsed:
        """Return the steps that a text means, and how sure that is.

        Raises:
            Declined: the text is none that the model could know.
            InferenceError: there is no whole answer.
        """
        words = plain_words(text)
        if not words or foreign_share(text) > MOST_FOREIGN:
            raise Declined("no words that I know")
        if len(words) > MOST_COMMAND_WORDS:
            raise Declined(f"{len(words)} words, more than the {MOST_COMMAND_WORDS} of a command")
        bounds = AnswerBounds(deadline=deadline, most_tokens=self.model.language.most_tokens)
        message = {"role": "user", "content": " ".join(words)}
        answer = self.model.answer([message], bounds, answer_schema(words))
        steps = tuple(map(_stripped, json.loads(answer.text)["steps"]))
        oddities = oddities_of(steps, words, self._known)
        features = dict(features_of(answer.chosen, oddities))
        return Parsed(
            words=tuple(words),
            steps=steps,
            confidence=confidence_of(features, self._weights),
            features=features,
            oddities=oddities,
        )

    def close(self) -> None:
        """Release the memory."""
        self.model.close()
        self.claim.release()


def open_command_parser(model: StoredModel, choice: ModelChoice) -> CommandParser:
    """Open the command parser of a model's folder.

    Raises:
        InferenceError: it cannot be opened, or is none; each kind says why.
    """
    opened = open_language_model(model, choice)
    return CommandParser(opened, known_words(model.folder))


def known_words(folder: Path) -> frozenset[str]:
    """Return the words that a model was shown.

    Raises:
        ModelMismatch: the folder has no such list.
    """
    file = folder / KNOWN_WORDS
    try:
        return frozenset(file.read_text(encoding="utf-8").split())
    except (OSError, UnicodeDecodeError) as error:
        raise ModelMismatch(folder.name, (f"{KNOWN_WORDS}: {error}",)) from error


# Which words that change a command's scope a field or a step stands for, besides what it copies.
_STANDS_FOR: Final[Mapping[str, frozenset[str]]] = {
    "except": WORDS[ScopeGroup.EXCEPTION] | WORDS[ScopeGroup.NEGATION],
    "else": WORDS[ScopeGroup.ALTERNATIVE] | {"if"},
    "see": frozenset({"if", "whether", "when"}),
    "forbid": WORDS[ScopeGroup.NEGATION],
    "permit": frozenset({"again"}),
    "nothing": WORDS[ScopeGroup.NEGATION],
    "await": frozenset({"when", "whenever", "once", "until", "till", "before"}),
}


def _covered(parsed: Parsed) -> frozenset[str]:
    """Return the words of a command that an answer has copied, or stands for otherwise."""
    copied = (
        word
        for _, span in copied_spans(parsed.steps, parsed.words)
        if span is not None
        for word in span.spoken
    )
    stood_for = (
        word
        for step in parsed.steps
        for name in (step["do"], *step)
        for word in _STANDS_FOR.get(name, ())
    )
    return frozenset((*copied, *stood_for))


def _stripped(step: Step) -> Step:
    """Return a step without the space before what was copied."""
    return {name: value.strip() if name in COPIED_FIELDS else value for name, value in step.items()}
