"""Write the trained decoder as a folder that the robot loads: graph, configuration, tokenizer."""

import json
from collections import Counter
from pathlib import Path
from random import Random
from typing import Any, Final

import numpy as np
import onnx
import torch
from numpy.typing import NDArray

from training.planner.files import CONFIG, GRAPH, KNOWN_WORDS, TOKENIZER, TOKENIZER_CONFIG
from training.planner.graph import Sizes, decoder_graph, genai_config
from training.planner.network import PlanDecoder
from training.planner.sentences.composing import Composer
from training.planner.settings import NetworkShape
from training.planner.tokens import ANSWER, COMMAND, END, PAD, load_tokenizer
from training.planner.training import STATE, WEIGHTS

CONTEXT_TOKENS: Final = 384
# Plain words with a space before each, as the tokenizer was trained on them.
TEMPLATE: Final = COMMAND + " {{ messages[-1]['content'] }}" + ANSWER
_LINES: Final = ("query", "key", "value", "out", "gate", "up", "down")
_NORMS: Final = ("attention_norm", "inner_norm")
_EXAMPLES: Final = 40_000
_SEED: Final = 77
_LEAST_SHOWN: Final = 4


def export(out: Path, models: Path, shape: NetworkShape, chatter: tuple[str, ...] = ()) -> None:
    """Write the folder.

    Raises:
        FileNotFoundError: nothing has been trained.
    """
    models.mkdir(parents=True, exist_ok=True)
    tokenizer = load_tokenizer(out / TOKENIZER)
    sizes = sizes_of(shape)
    onnx.save(decoder_graph(weights_of(_trained(out, shape)), sizes), models / GRAPH)
    tokenizer.save(str(models / TOKENIZER))
    words = known_words(Composer(chatter=chatter))
    (models / KNOWN_WORDS).write_text("\n".join(words) + "\n", encoding="utf-8")
    config = genai_config(
        sizes, kind="llama", end_id=tokenizer.token_to_id(END), pad_id=tokenizer.token_to_id(PAD)
    )
    _write(models / CONFIG, config)
    _write(
        models / TOKENIZER_CONFIG,
        {
            "tokenizer_class": "PreTrainedTokenizerFast",
            "eos_token": END,
            "pad_token": PAD,
            "chat_template": TEMPLATE,
        },
    )


def known_words(composer: Composer) -> list[str]:
    """Return the words that training shows often: any other is strange to the model.

    They are in the order of the alphabet; invented ones come up too seldom.
    """
    random = Random(_SEED)
    counts: Counter[str] = Counter()
    for _ in range(_EXAMPLES):
        counts.update(composer.example(random).command.split())
    return sorted(word for word, count in counts.items() if count >= _LEAST_SHOWN)


def sizes_of(shape: NetworkShape) -> Sizes:
    """Return the sizes of the graph for a network."""
    return Sizes(
        vocabulary=shape.vocabulary,
        width=shape.width,
        layers=shape.layers,
        heads=shape.heads,
        kv_heads=shape.heads,
        head_size=shape.head_width,
        context_tokens=CONTEXT_TOKENS,
        rope_theta=shape.rope_theta,
        epsilon=shape.epsilon,
    )


def weights_of(network: PlanDecoder) -> dict[str, NDArray[np.float32]]:
    """Return a network's weights as the graph names them, matrices as inputs x outputs."""
    state = {name: values.detach().float().numpy() for name, values in network.state_dict().items()}
    weights = {"embedding": state["embedding.weight"], "norm": state["norm.weight"]}
    for layer in range(network.shape.layers):
        for name in _LINES:
            weights[f"{layer}.{name}"] = state[f"layers.{layer}.{name}.weight"].T
        for name in _NORMS:
            weights[f"{layer}.{name}"] = state[f"layers.{layer}.{name}.weight"]
    return weights


def _trained(out: Path, shape: NetworkShape) -> PlanDecoder:
    """Return the finished network, or where there is none yet the state of the training."""
    network = PlanDecoder(shape)
    if (out / WEIGHTS).exists():
        network.load_state_dict(torch.load(out / WEIGHTS, weights_only=True))
    else:
        network.load_state_dict(torch.load(out / STATE, weights_only=True)["network"])
    return network


def _write(file: Path, document: dict[str, Any]) -> None:
    file.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
