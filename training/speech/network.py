"""Be a small Whisper: the same layers under the same names, so that its weights convert at once.

A head beside it names the sound of speech of each 20 ms while it learns; it is not shipped.
"""

from typing import Final

import torch
from torch import Tensor, nn
from torch.nn import functional

from training.speech.sizes import TrainingSize
from training.voices.phones import PHONES

MELS: Final = 80
LARGEST_FRAMES: Final = 3000
TEXT_POSITIONS: Final = 448
FRAMES_PER_STATE: Final = 2


def sinusoids(length: int, channels: int) -> Tensor:
    """Return the fixed places of Whisper's encoder."""
    step = torch.log(torch.tensor(10_000.0)) / (channels // 2 - 1)
    scales = torch.exp(-step * torch.arange(channels // 2))
    angles = torch.arange(length)[:, None] * scales[None, :]
    return torch.cat([angles.sin(), angles.cos()], dim=1)


class Attention(nn.Module):
    """Attend to a sequence; names as in Whisper."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.k_proj = nn.Linear(width, width, bias=False)
        self.v_proj = nn.Linear(width, width)
        self.q_proj = nn.Linear(width, width)
        self.out_proj = nn.Linear(width, width)

    def forward(self, states: Tensor, seen: Tensor, causal: bool = False) -> Tensor:
        """Return what each state takes from those that it sees."""
        parts = (self.q_proj(states), self.k_proj(seen), self.v_proj(seen))
        q, k, v = (part.unflatten(2, (self.heads, -1)).transpose(1, 2) for part in parts)
        # torch's own attention takes half of a step on a CPU, most of it backwards.
        scores = (q * q.shape[-1] ** -0.5) @ k.transpose(2, 3)
        if causal:
            later = torch.ones(scores.shape[-2:], dtype=torch.bool, device=q.device).triu(1)
            scores = scores.masked_fill(later, float("-inf"))
        mixed = functional.softmax(scores, dim=-1, dtype=scores.dtype) @ v
        out: Tensor = self.out_proj(mixed.transpose(1, 2).flatten(2))
        return out


class EncoderLayer(nn.Module):
    """Mix over time, then over channels."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.self_attn = Attention(width, heads)
        self.self_attn_layer_norm = nn.LayerNorm(width)
        self.fc1 = nn.Linear(width, 4 * width)
        self.fc2 = nn.Linear(4 * width, width)
        self.final_layer_norm = nn.LayerNorm(width)

    def forward(self, x: Tensor) -> Tensor:
        """Return the states of the next layer."""
        normed = self.self_attn_layer_norm(x)
        x = x + self.self_attn(normed, normed)
        out: Tensor = x + self.fc2(functional.gelu(self.fc1(self.final_layer_norm(x))))
        return out


class DecoderLayer(EncoderLayer):
    """Look at the text so far, then at the sound."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__(width, heads)
        self.encoder_attn = Attention(width, heads)
        self.encoder_attn_layer_norm = nn.LayerNorm(width)

    def forward(self, x: Tensor, sound: Tensor) -> Tensor:  # type: ignore[override]
        """Return the states of the next layer."""
        normed = self.self_attn_layer_norm(x)
        x = x + self.self_attn(normed, normed, causal=True)
        x = x + self.encoder_attn(self.encoder_attn_layer_norm(x), sound)
        out: Tensor = x + self.fc2(functional.gelu(self.fc1(self.final_layer_norm(x))))
        return out


class SpeechEncoder(nn.Module):
    """Turn frames into states, two frames each."""

    def __init__(self, size: TrainingSize) -> None:
        super().__init__()
        self.conv1 = nn.Conv1d(MELS, size.width, kernel_size=3, padding=1)
        self.conv2 = nn.Conv1d(size.width, size.width, kernel_size=3, stride=2, padding=1)
        self.embed_positions = nn.Embedding(LARGEST_FRAMES // FRAMES_PER_STATE, size.width)
        self.embed_positions.weight = nn.Parameter(
            sinusoids(LARGEST_FRAMES // FRAMES_PER_STATE, size.width), requires_grad=False
        )
        self.layers = nn.ModuleList(
            EncoderLayer(size.width, size.heads) for _ in range(size.encoder_layers)
        )
        self.layer_norm = nn.LayerNorm(size.width)

    def forward(self, frames: Tensor) -> Tensor:
        """Return states (clip, time, width) of frames (clip, mel, time)."""
        x = functional.gelu(self.conv1(frames))
        x = functional.gelu(self.conv2(x)).transpose(1, 2)
        x = x + self.embed_positions.weight[: x.shape[1]]
        for layer in self.layers:
            x = layer(x)
        out: Tensor = self.layer_norm(x)
        return out


class SpeechDecoder(nn.Module):
    """Write the text that the states hold, token by token."""

    def __init__(self, size: TrainingSize, tokens: int) -> None:
        super().__init__()
        self.embed_tokens = nn.Embedding(tokens, size.width)
        self.embed_positions = nn.Embedding(TEXT_POSITIONS, size.width)
        self.layers = nn.ModuleList(
            DecoderLayer(size.width, size.heads) for _ in range(size.decoder_layers)
        )
        self.layer_norm = nn.LayerNorm(size.width)
        nn.init.normal_(self.embed_tokens.weight, std=0.02)
        nn.init.normal_(self.embed_positions.weight, std=0.01)

    def forward(self, tokens: Tensor, sound: Tensor) -> Tensor:
        """Return the logits of the token after each."""
        x = self.embed_tokens(tokens) + self.embed_positions.weight[: tokens.shape[1]]
        for layer in self.layers:
            x = layer(x, sound)
        return functional.linear(self.layer_norm(x), self.embed_tokens.weight)


class RecogniserNetwork(nn.Module):
    """Hold encoder and decoder, and the head that names sounds."""

    def __init__(self, size: TrainingSize, tokens: int) -> None:
        super().__init__()
        self.encoder = SpeechEncoder(size)
        self.decoder = SpeechDecoder(size, tokens)
        self.sounds = nn.Linear(size.width, FRAMES_PER_STATE * len(PHONES))

    def forward(self, frames: Tensor, tokens: Tensor) -> tuple[Tensor, Tensor]:
        """Return logits of tokens (clip, place, token) and of sounds (clip, frame, phone)."""
        states = self.encoder(frames)
        sounds = self.sounds(states).unflatten(2, (FRAMES_PER_STATE, -1)).flatten(1, 2)
        return self.decoder(tokens, states), sounds
