"""Plan with one model behind a server; where it is unsure, ask it in several ways and count."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.model_servers.asking import StructuredAsker
from vla_deploy.model_servers.chat import Chat, Message, Role
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.model_servers.errors import AnswerUnusable, ModelServerError
from vla_deploy.model_servers.picture import Image, small_jpeg
from vla_deploy.model_servers.server import ModelServer
from vla_deploy.one_line import one_line
from vla_deploy.planning.chat_models.chat_back_end import SURE, ChatBackEnd, PlanAnswer
from vla_deploy.planning.comparison import move_the_same
from vla_deploy.planning.errors import Ambiguous, CannotBeDone, Declined, PlanningError
from vla_deploy.planning.interfaces import Aid, Check, Proposal, Request
from vla_deploy.planning.plan import Plan
from vla_deploy.planning.prompts.composing import DEFAULT_ROOM, chat_for, filled

# A plan of which the model is not sure is asked for in the other ways, too.
_WAYS: Final = ("few_shot", "chain_of_thought", "structured")
_FAULT_CHARACTERS: Final = 400
# Another question takes about as long as the longest before it.
_TIME_MARGIN: Final = 1.3


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanCandidate:
    """Hold a plan that may run, as it was proposed and as it would, and how sure its model is."""

    plan: Plan
    checked: Plan
    confidence: float


class ServedModel(ChatBackEnd):
    """Ask one server for plans; calls block until the deadline at most.

    For one command it is asked for so many `candidates` at most, in prompts of so many characters.
    """

    def __init__(
        self,
        server: ModelServer,
        robot: str,
        places: Sequence[str],
        check: Check,
        *,
        candidates: int = 3,
        prompt_characters: int = DEFAULT_ROOM,
    ) -> None:
        super().__init__(f"server {server.name}", robot, places)
        self._server = server
        self._check = check
        self._ways = _WAYS[:candidates]
        self._asker = StructuredAsker(server, self.shape)
        # The schema is a part of the prompt, too.
        self._room = prompt_characters - self._asker.schema_characters
        self.uses = frozenset({Aid.MEMORY, Aid.IMAGE} if self.sees else {Aid.MEMORY})

    @property
    def sees(self) -> bool:
        """Return whether the model takes images, and may be shown them."""
        settings = self._server.settings
        return settings.vision and (settings.is_local or settings.allow_images_off_robot)

    def document(self) -> dict[str, Any]:
        """Return how the server has been doing."""
        return self._server.document()

    def propose(self, request: Request, deadline: Deadline) -> Proposal:
        """Return the plan that most of the model's answers share.

        Raises:
            Declined: the server gives no answer in time, or none that can be read.
            CannotBeDone: the model sees no way, and says why.
            Ambiguous: the model asks something, or what it names is not clear.
            PlanInvalid: what it plans may not run, also after it was sent the reason.
        """
        found: list[PlanCandidate] = []
        asked = 0
        failure: PlanningError = Declined("it was not asked")
        for way in self._ways:
            began_ns = deadline.clock.now_ns()
            asked += 1
            try:
                found.append(self._planned(request, way, deadline))
            except PlanningError as error:
                failure = error
                if isinstance(error, Ambiguous | _Gone):
                    break
            took_s = (deadline.clock.now_ns() - began_ns) / NS_PER_S
            is_sure = asked == 1 and found and found[0].confidence >= SURE
            if is_sure or deadline.left_s < _TIME_MARGIN * took_s:
                break
        if not found:
            raise failure
        candidate, confidence = elected(found, asked, request)
        return self.proposal(candidate.plan, confidence)

    def _planned(self, request: Request, way: str, deadline: Deadline) -> PlanCandidate:
        """Return one plan that may run; a model whose plan is refused is sent the reason, once."""
        image = self._image(request)
        jpeg = None if image is None else small_jpeg(image)
        chat = chat_for(request, self.robot, way, self._room, jpeg)
        answer = self._ask(chat, deadline)
        try:
            return self._candidate(answer, request)
        except (Ambiguous, CannotBeDone):
            raise
        except PlanningError as error:
            if deadline.left_s <= 0.0:
                raise
            return self._candidate(self._ask(_refused(chat, answer, error), deadline), request)

    def _candidate(self, answer: PlanAnswer, request: Request) -> PlanCandidate:
        plan = self.planned(answer, request)
        return PlanCandidate(
            plan=plan, checked=self._check(plan, request), confidence=answer.confidence
        )

    def _ask(self, chat: Chat, deadline: Deadline) -> PlanAnswer:
        try:
            return self._asker.ask(chat, deadline)
        except AnswerUnusable as error:
            raise Declined(one_line(error)) from error
        except ModelServerError as error:
            raise _Gone(one_line(error)) from error

    def _image(self, request: Request) -> Image | None:
        return request.image if self.sees else None


class _Gone(Declined):
    """Say that asking the server again would be in vain."""


def _refused(chat: Chat, answer: PlanAnswer, error: PlanningError) -> Chat:
    """Return the conversation that says why a model's plan was refused, without images."""
    before = tuple(replace(message, images=()) for message in chat.messages)
    said = Message(role=Role.ASSISTANT, text=answer.model_dump_json())
    wish = Message(text=filled("refused", faults=one_line(error)[:_FAULT_CHARACTERS]))
    return replace(chat, messages=(*before, said, wish))


# --- the vote -------------------------------------------------------------------------------------


def elected(
    candidates: Sequence[PlanCandidate], asked: int, request: Request
) -> tuple[PlanCandidate, float]:
    """Return the plan that most candidates share, and how sure the vote makes it.

    Between equals the more feasible one is taken. `asked` is how many plans were asked for: one
    that could not run votes for nothing. A single plan is as sure as its model is; else the rule of
    succession holds: three of three give 0.8, two of three 0.6.
    """
    votes = [
        sum(move_the_same(one.checked, other.checked, request) for other in candidates)
        for one in candidates
    ]
    best = max(range(len(candidates)), key=lambda n: (votes[n], *_ease(candidates[n])))
    confidence = candidates[best].confidence if asked == 1 else (votes[best] + 1) / (asked + 2)
    return candidates[best], confidence


def _ease(candidate: PlanCandidate) -> tuple[float, float, int]:
    """Return how feasible a plan is: its weakest action, how sure its model is, how short it is."""
    actions = candidate.checked.actions
    weakest = min((one.feasibility_score for one in actions), default=0.0)
    return (weakest, candidate.confidence, -len(actions))
