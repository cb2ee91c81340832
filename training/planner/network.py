"""Define the decoder: a Llama of small size, with tied embeddings."""

from collections.abc import Mapping

import torch
from torch import Tensor, nn
from torch.nn import functional

from training.planner.settings import NetworkShape


class Norm(nn.Module):
    """Scale by the root of the mean square."""

    def __init__(self, width: int, epsilon: float) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.ones(width))
        self.epsilon = epsilon

    def forward(self, values: Tensor) -> Tensor:
        """Return values of the same shape."""
        scale = torch.rsqrt(values.pow(2).mean(-1, keepdim=True) + self.epsilon)
        return values * scale * self.weight


class Layer(nn.Module):
    """Attend to what came before, then think."""

    def __init__(self, shape: NetworkShape) -> None:
        super().__init__()
        self.shape = shape
        self.attention_norm = Norm(shape.width, shape.epsilon)
        self.query = nn.Linear(shape.width, shape.width, bias=False)
        self.key = nn.Linear(shape.width, shape.width, bias=False)
        self.value = nn.Linear(shape.width, shape.width, bias=False)
        self.out = nn.Linear(shape.width, shape.width, bias=False)
        self.inner_norm = Norm(shape.width, shape.epsilon)
        self.gate = nn.Linear(shape.width, shape.inner, bias=False)
        self.up = nn.Linear(shape.width, shape.inner, bias=False)
        self.down = nn.Linear(shape.inner, shape.width, bias=False)

    def forward(self, values: Tensor, cosine: Tensor, sine: Tensor) -> Tensor:
        """Return values of the same shape, batch x tokens x width."""
        batch, tokens, _ = values.shape
        normed = self.attention_norm(values)
        sizes = (batch, tokens, self.shape.heads, self.shape.head_width)
        query, key, value = (
            line(normed).view(sizes).transpose(1, 2) for line in (self.query, self.key, self.value)
        )
        query, key = rotated(query, cosine, sine), rotated(key, cosine, sine)
        # By hand: on a CPU the fused kernel takes ten times as long backwards for so short texts.
        ahead = torch.ones(tokens, tokens, dtype=torch.bool).triu(1)
        fit = (query @ key.transpose(2, 3)) * self.shape.head_width**-0.5
        seen = fit.masked_fill(ahead, -torch.inf).softmax(-1).to(value.dtype) @ value
        values = values + self.out(seen.transpose(1, 2).reshape(batch, tokens, -1))
        normed = self.inner_norm(values)
        thought: Tensor = self.down(functional.silu(self.gate(normed)) * self.up(normed))
        return values + thought


class PlanDecoder(nn.Module):
    """Predict the next token from those before."""

    def __init__(self, shape: NetworkShape) -> None:
        super().__init__()
        self.shape = shape
        self.embedding = nn.Embedding(shape.vocabulary, shape.width)
        self.layers = nn.ModuleList(Layer(shape) for _ in range(shape.layers))
        self.norm = Norm(shape.width, shape.epsilon)
        nn.init.normal_(self.embedding.weight, std=0.02)
        for layer in self.layers:
            for name, weights in layer.named_parameters():
                if weights.dim() == 2:
                    depth = (2 * shape.layers) ** -0.5 if name.startswith(("out", "down")) else 1.0
                    nn.init.normal_(weights, std=depth * shape.width**-0.5)

    def forward(self, tokens: Tensor) -> Tensor:
        """Return what the last layer makes of tokens: batch x tokens x width."""
        cosine, sine = angles(self.shape, tokens.shape[1])
        values = self.embedding(tokens)
        for layer in self.layers:
            values = layer(values, cosine, sine)
        normed: Tensor = self.norm(values)
        return normed

    def scores(self, values: Tensor) -> Tensor:
        """Return a score for each token of the vocabulary."""
        return functional.linear(values, self.embedding.weight)


def deepened(weights: Mapping[str, Tensor], into: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Return weights of a deeper network, that of `into`, which says what `weights` say.

    Each layer of theirs is followed by as many of `into`, which add nothing to the sum until they
    learn to (Chen et al., "Net2Net", 2016).

    Raises:
        ValueError: `into` has not a multiple of their layers.
    """
    layers, given = layers_of(into), layers_of(weights)
    times, rest = divmod(layers, given)
    if rest or not times:
        raise ValueError(f"expected a multiple of {given} layers, got {layers}")
    deeper = dict(into)
    for name in deeper:
        parts = name.split(".")
        if parts[0] != "layers":
            deeper[name] = weights[name]
            continue
        layer, new = divmod(int(parts[1]), times)
        if not new:
            deeper[name] = weights[".".join((parts[0], str(layer), *parts[2:]))]
        elif parts[2] in ("out", "down"):
            deeper[name] = torch.zeros_like(deeper[name])
    return deeper


def layers_of(weights: Mapping[str, Tensor]) -> int:
    """Return how many layers a network has."""
    return len({name.split(".")[1] for name in weights if name.startswith("layers.")})


def angles(shape: NetworkShape, tokens: int) -> tuple[Tensor, Tensor]:
    """Return cosines and sines of each position: tokens x half a head's width."""
    half = shape.head_width // 2
    rates = shape.rope_theta ** (-torch.arange(half, dtype=torch.float32) / half)
    turned = torch.outer(torch.arange(tokens, dtype=torch.float32), rates)
    return turned.cos(), turned.sin()


def rotated(values: Tensor, cosine: Tensor, sine: Tensor) -> Tensor:
    """Turn the two halves of each head by its position."""
    first, second = values.chunk(2, dim=-1)
    cosine, sine = cosine.to(values.dtype), sine.to(values.dtype)
    return torch.cat((first * cosine - second * sine, second * cosine + first * sine), dim=-1)
