"""Weights are read back from the shipped recogniser, as its own runtime uses them."""

import math
from pathlib import Path

import ctranslate2
import numpy as np
import pytest
from numpy.typing import NDArray

from training.speech.warm_start import NotReadable, weights_of, widened
from vla_deploy import speech

Array = NDArray[np.float32]
SHIPPED = Path(speech.__path__[0]).parent / "models" / "commands-whisper"
HEADS = 8
FRAMES = 64


@pytest.fixture(scope="module")
def weights() -> dict[str, Array]:
    return weights_of(SHIPPED / "model.bin")


def linear(weights: dict[str, Array], name: str, x: Array) -> Array:
    return x @ weights[f"{name}.weight"].T + weights.get(f"{name}.bias", 0.0)


def norm(weights: dict[str, Array], name: str, x: Array) -> Array:
    x = (x - x.mean(-1, keepdims=True)) / np.sqrt(x.var(-1, keepdims=True) + 1e-5)
    return x * weights[f"{name}.weight"] + weights[f"{name}.bias"]


def gelu(x: Array) -> Array:
    return 0.5 * x * (1.0 + np.vectorize(math.erf)(x / math.sqrt(2.0)))


def convolved(weights: dict[str, Array], name: str, x: Array, stride: int) -> Array:
    padded = np.pad(x, ((0, 0), (1, 1)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, 3, axis=1)[:, ::stride]
    kernel = weights[f"{name}.weight"]
    return np.einsum("ctk,ock->ot", windows, kernel) + weights[f"{name}.bias"][:, None]


def attended(weights: dict[str, Array], name: str, x: Array) -> Array:
    q, k, v = (
        linear(weights, f"{name}.{part}_proj", x).reshape(len(x), HEADS, -1).swapaxes(0, 1)
        for part in "qkv"
    )
    scores = q @ k.swapaxes(1, 2) / np.sqrt(q.shape[-1])
    shares = np.exp(scores - scores.max(-1, keepdims=True))
    mixed = (shares / shares.sum(-1, keepdims=True)) @ v
    return linear(weights, f"{name}.out_proj", mixed.swapaxes(0, 1).reshape(len(x), -1))


def encoded(weights: dict[str, Array], frames: Array) -> Array:
    x = gelu(convolved(weights, "encoder.conv1", frames, 1))
    x = gelu(convolved(weights, "encoder.conv2", x, 2)).T
    x = x + weights["encoder.embed_positions.weight"][: len(x)]
    layers = 1 + max(int(n.split(".")[2]) for n in weights if n.startswith("encoder.layers."))
    for layer in range(layers):
        at = f"encoder.layers.{layer}"
        x = x + attended(weights, f"{at}.self_attn", norm(weights, f"{at}.self_attn_layer_norm", x))
        hidden = linear(weights, f"{at}.fc1", norm(weights, f"{at}.final_layer_norm", x))
        x = x + linear(weights, f"{at}.fc2", gelu(hidden))
    return norm(weights, "encoder.layer_norm", x)


def test_the_weights_make_of_sound_what_the_runtime_makes_of_it(weights: dict[str, Array]) -> None:
    frames = np.random.default_rng(5).standard_normal((80, FRAMES)).astype(np.float32)
    model = ctranslate2.models.Whisper(str(SHIPPED), compute_type="float32")
    told = np.array(model.encode(ctranslate2.StorageView.from_array(frames[None])))[0]
    np.testing.assert_allclose(encoded(weights, frames), told, atol=2e-3)


def test_the_decoder_is_whole(weights: dict[str, Array]) -> None:
    shapes = {name: values.shape for name, values in weights.items() if "decoder" in name}
    for layer in range(2):
        at = f"decoder.layers.{layer}"
        for attention in ("self_attn", "encoder_attn"):
            for part in ("q_proj", "k_proj", "v_proj", "out_proj"):
                assert shapes[f"{at}.{attention}.{part}.weight"] == (256, 256)
            assert f"{at}.{attention}.k_proj.bias" not in shapes
        assert shapes[f"{at}.fc1.weight"] == (1024, 256)
    assert shapes["decoder.embed_tokens.weight"] == (2150, 256)
    assert shapes["decoder.embed_positions.weight"] == (448, 256)
    assert np.abs(weights["decoder.embed_tokens.weight"]).max() < 2.0


@pytest.mark.parametrize("kept", [0, 3, 100, 100_000])
def test_a_file_that_is_cut_off_is_refused(tmp_path: Path, kept: int) -> None:
    cut = tmp_path / "model.bin"
    cut.write_bytes((SHIPPED / "model.bin").read_bytes()[:kept])
    with pytest.raises(NotReadable, match=r"expected CTranslate2's version 6"):
        weights_of(cut)


def test_a_network_made_twice_as_wide_tells_the_same(weights: dict[str, Array]) -> None:
    frames = np.random.default_rng(6).standard_normal((80, FRAMES)).astype(np.float32)
    narrow = encoded(weights, frames)
    wide = widened(weights, 0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(globals(), "HEADS", 2 * HEADS)
        told = encoded(wide, frames)
    np.testing.assert_allclose(told, np.concatenate([narrow, narrow], axis=1), atol=1e-3)
    names = "decoder.layer_norm.weight", "decoder.embed_tokens.weight"
    (gain, words), (wide_gain, wide_words) = ([w[name] for name in names] for w in (weights, wide))
    state = np.random.default_rng(7).standard_normal(len(gain)).astype(np.float32)
    logits = wide_words @ (wide_gain * np.concatenate([state, state]))
    np.testing.assert_allclose(logits, words @ (gain * state), atol=1e-3)
    kernel = wide["encoder.layers.0.fc1.weight"]
    assert np.abs(kernel[: len(kernel) // 2] - kernel[len(kernel) // 2 :]).max() > 1e-3
