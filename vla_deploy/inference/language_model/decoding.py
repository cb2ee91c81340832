"""Decode one text: its tokens and what the model knows of them, and what may come next."""

import json
from collections.abc import Sequence
from typing import Any, Final

import llguidance
import llguidance.numpy
import numpy as np
from numpy.typing import NDArray

from vla_deploy.inference.errors import AnswerFailed, ModelMismatch, RunFailed
from vla_deploy.inference.language_model.model_folder import GenaiConfig
from vla_deploy.inference.opening import GraphSession

# A weak model would else go on with tabs and blanks for ever.
_GUIDANCE: Final = {"whitespace_flexible": False}
# Tensors as the builder of onnxruntime-genai names them.
_PAST, _PRESENT, _LOGITS, _POSITIONS = "past_key_values.", "present.", "logits", "position_ids"
JsonSchema = dict[str, Any]
Scores = NDArray[np.float32]


class Decoder:
    """Hold one text under way: its tokens, and keys and values of each layer for them."""

    def __init__(self, session: GraphSession, config: GenaiConfig) -> None:
        """Take an open session.

        Raises:
            ModelMismatch: the graph lacks keys and values, or scores.
        """
        self._session = session
        self._config = config
        self.tokens: list[int] = []
        self._takes_positions = _POSITIONS in {one.name for one in session.inputs}
        # Keys and values: batch x heads x tokens x head size.
        self._empty: dict[str, NDArray[Any]] = {}
        for one in session.inputs:
            match one.name.startswith(_PAST), one.shape:
                case True, (_, int(heads), _, int(size)):
                    self._empty[one.name] = np.zeros((1, heads, 0, size), one.dtype)
        self._outputs = [_LOGITS, *(name.replace(_PAST, _PRESENT) for name in self._empty)]
        missing = set(self._outputs) - {one.name for one in session.outputs}
        if missing or not self._empty:
            path, what = session.path, ", ".join(sorted(missing)) or f"{_PAST}*"
            fault = f"{path.name} has no {what}; export it with the builder of onnxruntime-genai"
            raise ModelMismatch(str(path.parent), (fault,))
        self._past = dict(self._empty)

    def feed(self, tokens: Sequence[int]) -> Scores:
        """Add tokens to the text; return the score of each token of the vocabulary to come next.

        Raises:
            AnswerFailed: the text would be longer than the model's context.
            RunFailed: the run failed, or gave scores that are no numbers.
        """
        self.check_room(len(tokens))
        known = len(self.tokens)
        length = known + len(tokens)
        inputs: dict[str, NDArray[Any]] = {
            "input_ids": np.asarray([tokens], dtype=np.int64),
            "attention_mask": np.ones((1, length), dtype=np.int64),
            **self._past,
        }
        if self._takes_positions:
            inputs[_POSITIONS] = np.arange(known, length, dtype=np.int64)[None]
        outputs = self._session.run(self._outputs, inputs)
        scores = outputs.pop(_LOGITS)[0, -1, : self._config.vocabulary].astype(np.float32)
        if np.isnan(scores).any():
            raise RunFailed(f"{self._session.path}: its scores are no numbers; export it again")
        self._past = {name.replace(_PRESENT, _PAST): values for name, values in outputs.items()}
        self.tokens += tokens
        return scores

    def check_room(self, count: int) -> None:
        """Accept that so many tokens are added to the text.

        Raises:
            AnswerFailed: it would be longer than the model's context.
        """
        length, most = len(self.tokens) + count, self._config.context_tokens
        if length > most:
            raise AnswerFailed(
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


class Constraint:
    """Allow only tokens of one answer that can still become a JSON text of a schema."""

    def __init__(self, tokenizer: llguidance.LLTokenizer, schema: JsonSchema) -> None:
        """Begin an answer.

        Raises:
            AnswerFailed: the schema is none, or says what no grammar can.
        """
        guided = json.dumps({**schema, "x-guidance": _GUIDANCE})
        try:
            grammar = llguidance.LLMatcher.grammar_from_json_schema(guided)
        except ValueError as error:
            raise AnswerFailed(f"no grammar for this JSON Schema: {error}") from error
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
            AnswerFailed: one was not.
        """
        self._matcher.consume_tokens(list(tokens))
        self._check()

    def _check(self) -> None:
        if self._matcher.is_error():
            raise AnswerFailed(f"the constraint broke: {self._matcher.get_error()}")
