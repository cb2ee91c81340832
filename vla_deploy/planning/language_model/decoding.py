"""Generate one answer: the likeliest token each time, of those that the schema allows."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import llguidance
import llguidance.numpy
import numpy as np
from numpy.typing import NDArray

from vla_deploy.inference.errors import RunFailed
from vla_deploy.inference.graph_session import GraphSession
from vla_deploy.model_servers.deadline import Deadline
from vla_deploy.planning.language_model.errors import (
    AnswerCut,
    AnswerLate,
    ModelFolderInvalid,
    PromptTooLong,
    SchemaUnusable,
)
from vla_deploy.planning.language_model.model_folder import GenaiConfig

# A weak model would else go on with tabs and blanks for ever.
_GUIDANCE: Final = {"whitespace_flexible": False}
# Tokens of one run. Exports score every token that they read: 3000 of a prompt at once would be
# gigabytes of scores, of which the last is wanted, and seconds that nothing can break off.
PIECE_TOKENS: Final = 128
JsonSchema = dict[str, Any]
Scores = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnswerBounds:
    """Bound an answer: it ends by the deadline, which also a recall ends, and by its length."""

    deadline: Deadline
    most_tokens: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Generated:
    """Hold the tokens of a whole answer, and what they cost.

    `chosen` is the log-probability of each token that the model was asked for, among all tokens,
    also those that the schema forbids: it is low where the model would have said something else.
    """

    tokens: tuple[int, ...]
    chosen: tuple[float, ...]
    reused_tokens: int
    runs: int


def generate(
    decoder: "Decoder",
    prompt: Sequence[int],
    constraint: "Constraint",
    end_ids: Sequence[int],
    bounds: AnswerBounds,
) -> Generated:
    """Answer a prompt.

    Forced tokens go in with the next token that the model is asked for, in one run. A long prompt
    is read piece by piece.

    Raises:
        AnswerLate: the deadline passed, or the answer is not awaited any more.
        AnswerCut: the answer is not whole after the most tokens that it may have.
        PromptTooLong: prompt and answer do not fit into the context.
        RunFailed: a run failed.
    """
    reused = decoder.keep(prompt)
    waiting = list(prompt[reused:])
    tokens: list[int] = []
    chosen: list[float] = []
    runs = 0
    while True:
        if forced := constraint.forced():
            constraint.take(forced)
            tokens += forced
            waiting += forced
        if constraint.is_done:
            break
        decoder.check_room(len(waiting))
        for begin in range(0, len(waiting), PIECE_TOKENS):
            _check_bounds(len(tokens), bounds)
            scores = decoder.feed(waiting[begin : begin + PIECE_TOKENS])
            runs += 1
        token, log_probability = _likeliest(scores, constraint)
        if token in end_ids:
            break
        tokens.append(token)
        chosen.append(log_probability)
        waiting = [token]
        constraint.take(waiting)
    return Generated(tokens=tuple(tokens), chosen=tuple(chosen), reused_tokens=reused, runs=runs)


def _likeliest(scores: Scores, constraint: "Constraint") -> tuple[int, float]:
    """Return the likeliest token of those allowed, and its log-probability among all."""
    allowed = np.where(constraint.allowed(len(scores)), scores, -np.inf)
    number = int(np.argmax(allowed))
    highest = float(scores.max())
    total = highest + float(np.log(np.exp(scores - highest).sum()))
    return number, float(scores[number]) - total


def _check_bounds(count: int, bounds: AnswerBounds) -> None:
    if bounds.deadline.left_s <= 0.0:
        why = "nobody waits for it any more" if bounds.deadline.is_recalled else "time is up"
        raise AnswerLate(f"the answer is not whole after {count} tokens: {why}")
    if count >= bounds.most_tokens:
        raise AnswerCut(f"the answer is not whole after {count} tokens, the most that it may")


class Decoder:
    """Hold one text under way: its tokens, and keys and values of each layer for them."""

    def __init__(self, session: GraphSession, config: GenaiConfig) -> None:
        """Take an open session.

        Raises:
            ModelFolderInvalid: the graph lacks tensors that the configuration names.
        """
        self._session = session
        self._config = config
        self.tokens: list[int] = []
        dtypes = {tensor.name: tensor.dtype for tensor in session.inputs}
        self._takes_positions = config.position_ids in dtypes
        self._check_names(dtypes)
        # Keys and values: batch x heads x tokens x head size.
        self._empty = {
            name: np.zeros((1, config.kv_heads, 0, config.head_size), dtype=dtypes[name])
            for name in config.past_names
        }
        self._past: dict[str, NDArray[Any]] = dict(self._empty)

    def feed(self, tokens: Sequence[int]) -> Scores:
        """Add tokens to the text; return the score of each token of the vocabulary to come next.

        Raises:
            PromptTooLong: the text would be longer than the model's context.
            RunFailed: the run failed, or gave scores that are no numbers.
        """
        self.check_room(len(tokens))
        config, known = self._config, len(self.tokens)
        length = known + len(tokens)
        inputs: dict[str, NDArray[Any]] = {
            config.input_ids: np.asarray([tokens], dtype=np.int64),
            config.attention_mask: np.ones((1, length), dtype=np.int64),
            **self._past,
        }
        if self._takes_positions:
            inputs[config.position_ids] = np.arange(known, length, dtype=np.int64)[None]
        outputs = self._session.run((config.logits, *config.present_names), inputs)
        scores = outputs[config.logits][0, -1, : config.vocabulary].astype(np.float32)
        if np.isnan(scores).any():
            raise RunFailed(f"{self._session.path}: its scores are no numbers; export it again")
        self._past = {
            past: outputs[present]
            for past, present in zip(config.past_names, config.present_names, strict=True)
        }
        self.tokens += tokens
        return scores

    def check_room(self, count: int) -> None:
        """Accept that so many tokens are added to the text.

        Raises:
            PromptTooLong: it would be longer than the model's context.
        """
        length, most = len(self.tokens) + count, self._config.context_tokens
        if length > most:
            raise PromptTooLong(
                f"{self._session.path.parent.name}: the text has {length} tokens, expected "
                f"{most} at most; shorten the prompt"
            )

    def keep(self, tokens: Sequence[int]) -> int:
        """Forget the text but for what it has in common with the beginning of tokens.

        Return how many that are; one token of them is always left to feed.
        """
        same = 0
        for old, new in zip(self.tokens, tokens[:-1], strict=False):
            if old != new:
                break
            same += 1
        self.tokens = self.tokens[:same]
        self._past = {
            name: values[:, :, :same] if same else self._empty[name]
            for name, values in self._past.items()
        }
        return same

    def _check_names(self, dtypes: dict[str, str]) -> None:
        config = self._config
        wanted = (config.input_ids, config.attention_mask, *config.past_names)
        missing = [name for name in wanted if name not in dtypes]
        given = {tensor.name for tensor in self._session.outputs}
        missing += [one for one in (config.logits, *config.present_names) if one not in given]
        if missing:
            path, named = self._session.path, ", ".join(missing[:4])
            fault = f"{path.name} has no tensors {named}, which genai_config.json names"
            raise ModelFolderInvalid(path.parent, (fault,))


def grammar_of(schema: JsonSchema) -> str:
    """Return the grammar of a JSON Schema.

    Raises:
        SchemaUnusable: it is none, or says what no grammar can.
    """
    guided = {**schema, "x-guidance": _GUIDANCE}
    try:
        return str(llguidance.LLMatcher.grammar_from_json_schema(json.dumps(guided)))
    except (ValueError, TypeError) as error:
        raise SchemaUnusable(f"no grammar for this JSON Schema: {error}") from error


class Constraint:
    """Allow only tokens of one answer that can still become a JSON text of a schema."""

    def __init__(self, tokenizer: llguidance.LLTokenizer, grammar: str) -> None:
        """Begin an answer.

        Raises:
            SchemaUnusable: the grammar is none.
        """
        self._matcher = llguidance.LLMatcher(tokenizer, grammar)
        self._bits = llguidance.numpy.allocate_token_bitmask(1, tokenizer.vocab_size)
        self._check()

    @property
    def is_done(self) -> bool:
        """Return whether the answer is whole and nothing may follow.

        It follows from the last token, so a token must be taken before this is asked.
        """
        return bool(self._matcher.is_stopped())

    def forced(self) -> list[int]:
        """Return the tokens that must come next, as there is no other way; often none."""
        return [int(token) for token in self._matcher.compute_ff_tokens()]

    def allowed(self, vocabulary: int) -> NDArray[np.bool_]:
        """Return for each token whether it may come next."""
        llguidance.numpy.fill_next_token_bitmask(self._matcher, self._bits)
        bits = np.unpackbits(self._bits.view(np.uint8).ravel(), bitorder="little")
        allowed = np.zeros(vocabulary, dtype=np.bool_)
        count = min(vocabulary, bits.size)
        allowed[:count] = bits[:count].astype(np.bool_)
        return allowed

    def take(self, tokens: Sequence[int]) -> None:
        """Go on by tokens that are allowed.

        Raises:
            SchemaUnusable: one was not.
        """
        self._matcher.consume_tokens(list(tokens))
        self._check()

    def _check(self) -> None:
        if self._matcher.is_error():
            raise SchemaUnusable(f"the constraint broke: {self._matcher.get_error()}")
