"""Allow only tokens that can still become a JSON text of a schema."""

import json
from collections.abc import Sequence
from typing import Any, Final

import llguidance
import llguidance.numpy
import numpy as np
from numpy.typing import NDArray

from vla_deploy.planning.language_model.errors import SchemaUnusable

# A weak model would else go on with tabs and blanks for ever.
_GUIDANCE: Final = {"whitespace_flexible": False}
JsonSchema = dict[str, Any]


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
    """Follow one answer token by token."""

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
        """Tell whether the answer is whole and nothing may follow.

        It is told by the last token, so a token must be taken before this is asked.
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
