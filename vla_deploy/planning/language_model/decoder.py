"""Feed tokens to a decoder and keep what it remembers of them between the runs."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.inference.errors import RunFailed
from vla_deploy.inference.graph_session import GraphSession
from vla_deploy.planning.language_model.errors import ModelFolderInvalid, PromptTooLong
from vla_deploy.planning.language_model.genai_config import GenaiConfig

Scores = NDArray[np.float32]
_LENGTH_AXIS: Final = 2  # of keys and values: batch x heads x tokens x head size


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
        config, known = self._config, len(self.tokens)
        length = known + len(tokens)
        if length > config.context_tokens:
            raise PromptTooLong(
                f"{self._session.path.parent.name}: the text has {length} tokens, expected "
                f"{config.context_tokens} at most; shorten the prompt"
            )
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
