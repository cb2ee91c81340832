"""Small language models of random weights, in the shapes of two families."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from tokenizers import AddedToken, Tokenizer
from tokenizers.decoders import ByteLevel as ByteLevelDecoder
from tokenizers.models import BPE
from tokenizers.pre_tokenizers import ByteLevel
from tokenizers.trainers import BpeTrainer

from training.planner.graph import Sizes, Weights, decoder_graph, genai_config

END = "<|im_end|>"
CHATML = (
    "{% for message in messages %}<|im_start|>{{ message.role }}\n{{ message.content }}<|im_end|>\n"
    "{% endfor %}{% if add_generation_prompt %}<|im_start|>assistant\n{% endif %}"
)
HEADERS = (
    "{{ bos_token }}{%- for message in messages %}<|start_header_id|>{{ message['role'] }}"
    "<|end_header_id|>\n\n{{ message['content'] | trim }}<|eot_id|>{%- endfor %}"
    "{{ '<|start_header_id|>assistant<|end_header_id|>\n\n' }}"
)
TEXTS = ['{"do":"go","where":"kitchen"}', "go to the kitchen", '{"steps":[1,2,30]}', "pick it up"]


@dataclass(frozen=True)
class Family:
    """How one family of exports differs: heads that share keys, biases, templates, positions."""

    name: str
    heads: int
    kv_heads: int
    has_bias: bool
    template: str
    takes_positions: bool


LLAMA = Family("llama", 4, 4, False, HEADERS, False)
QWEN = Family("qwen2", 4, 2, True, CHATML, True)


def tokenizer() -> Tokenizer:
    made = Tokenizer(BPE())
    made.pre_tokenizer = ByteLevel(add_prefix_space=False)
    made.decoder = ByteLevelDecoder()
    special = [AddedToken(END, special=True), AddedToken("<|im_start|>", special=True)]
    made.train_from_iterator(
        TEXTS * 4,
        BpeTrainer(
            vocab_size=300,
            special_tokens=special,
            initial_alphabet=ByteLevel.alphabet(),
            show_progress=False,
        ),
    )
    return made


def sizes_of(family: Family, vocabulary: int) -> Sizes:
    return Sizes(
        vocabulary=vocabulary, width=32, layers=2, heads=family.heads, kv_heads=family.kv_heads,
        head_size=16, context_tokens=256,
    )  # fmt: skip


def random_weights(sizes: Sizes, has_bias: bool) -> Weights:
    random = np.random.default_rng(3)

    def drawn(*shape: int) -> Any:
        return random.normal(0.0, 0.3, shape).astype(np.float32)

    queries, keys = sizes.heads * sizes.head_size, sizes.kv_heads * sizes.head_size
    weights = {"embedding": drawn(sizes.vocabulary, sizes.width), "norm": np.ones(32, np.float32)}
    for layer in range(sizes.layers):
        for name, columns in (("query", queries), ("key", keys), ("value", keys)):
            weights[f"{layer}.{name}"] = drawn(sizes.width, columns)
            if has_bias:
                weights[f"{layer}.{name}_bias"] = drawn(columns)
        weights[f"{layer}.out"] = drawn(queries, sizes.width)
        for name, rows, columns in (("gate", 32, 48), ("up", 32, 48), ("down", 48, 32)):
            weights[f"{layer}.{name}"] = drawn(rows, columns)
        for name in ("attention_norm", "inner_norm"):
            weights[f"{layer}.{name}"] = np.ones(sizes.width, np.float32)
    return weights


def write_folder(folder: Path, family: Family) -> Path:
    folder.mkdir(parents=True)
    made = tokenizer()
    made.save(str(folder / "tokenizer.json"))
    sizes = sizes_of(family, made.get_vocab_size())
    graph = decoder_graph(random_weights(sizes, family.has_bias), sizes)
    config = genai_config(sizes, kind=family.name, end_id=made.token_to_id(END), pad_id=0)
    if family.takes_positions:
        positions = onnx.helper.make_tensor_value_info(
            "position_ids", onnx.TensorProto.INT64, ["batch", "tokens"]
        )
        graph.graph.input.append(positions)
        config["model"]["decoder"]["inputs"]["position_ids"] = "position_ids"
        config["model"]["eos_token_id"] = [config["model"]["eos_token_id"]]
    onnx.save(graph, folder / "model.onnx")
    (folder / "genai_config.json").write_text(json.dumps(config))
    settings = {"bos_token": {"content": "<|begin|>"}, "chat_template": family.template}
    (folder / "tokenizer_config.json").write_text(json.dumps(settings))
    return folder


def folders_under(base: Path) -> dict[str, Path]:
    """Write a folder of each family."""
    return {one.name: write_folder(base / one.name, one) for one in (LLAMA, QWEN)}
