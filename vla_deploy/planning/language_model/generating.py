"""Generate one answer: the likeliest token each time, of those that the schema allows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.language_model.constraint import Constraint
from vla_deploy.planning.language_model.decoder import Decoder, Scores
from vla_deploy.planning.language_model.errors import AnswerCut, AnswerLate


@dataclass(frozen=True, slots=True, kw_only=True)
class Token:
    """Hold one token of an answer.

    `log_probability` is among all tokens, also those that the schema forbids: it is low where the
    model would have said something else. A forced token was not asked of the model, and has 0.
    """

    number: int
    log_probability: float
    is_forced: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """Hold a whole answer, and how many runs of the model it took."""

    text: str
    tokens: tuple[Token, ...]
    prompt_tokens: int
    reused_tokens: int
    runs: int

    @property
    def chosen(self) -> tuple[float, ...]:
        """Return the log-probability of each token that the model chose."""
        return tuple(one.log_probability for one in self.tokens if not one.is_forced)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """Bound an answer: it ends by the deadline, which also a recall ends, and by its length."""

    deadline: Deadline
    most_tokens: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Generated:
    """Hold the tokens of a whole answer, and what they cost."""

    tokens: tuple[Token, ...]
    reused_tokens: int
    runs: int


def generate(
    decoder: Decoder,
    prompt: Sequence[int],
    constraint: Constraint | None,
    end_ids: Sequence[int],
    bounds: Bounds,
) -> Generated:
    """Answer a prompt; without a constraint, until the model ends by itself.

    Forced tokens go in with the next token that the model is asked for, in one run.

    Raises:
        AnswerLate: the deadline passed, or nobody waits any more.
        AnswerCut: the answer is not whole after the most tokens that it may have.
        PromptTooLong: prompt and answer do not fit into the context.
        RunFailed: a run failed.
    """
    reused = decoder.keep(prompt)
    waiting = list(prompt[reused:])
    told: list[Token] = []
    runs = 0
    while True:
        forced = [] if constraint is None else constraint.forced()
        if constraint is not None and forced:
            constraint.take(forced)
            told += [Token(number=one, log_probability=0.0, is_forced=True) for one in forced]
            waiting += forced
        if constraint is not None and constraint.is_done:
            break
        _check_bounds(told, bounds)
        scores = decoder.feed(waiting)
        runs += 1
        token = _likeliest(scores, constraint)
        if token.number in end_ids:
            break
        told.append(token)
        waiting = [token.number]
        if constraint is not None:
            constraint.take(waiting)
    return Generated(tokens=tuple(told), reused_tokens=reused, runs=runs)


def _likeliest(scores: Scores, constraint: Constraint | None) -> Token:
    allowed = scores
    if constraint is not None:
        allowed = np.where(constraint.allowed(len(scores)), scores, -np.inf)
    number = int(np.argmax(allowed))
    highest = float(scores.max())
    total = highest + float(np.log(np.exp(scores - highest).sum()))
    return Token(number=number, log_probability=float(scores[number]) - total)


def _check_bounds(told: Sequence[Token], bounds: Bounds) -> None:
    if bounds.deadline.left_s <= 0.0:
        why = "nobody waits for it any more" if bounds.deadline.is_recalled else "time is up"
        raise AnswerLate(f"the answer is not whole after {len(told)} tokens: {why}")
    if len(told) >= bounds.most_tokens:
        raise AnswerCut(f"the answer is not whole after {len(told)} tokens, the most that it may")
