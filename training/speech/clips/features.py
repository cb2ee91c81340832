"""Turn waves into Whisper's frames, many at once, exactly as faster-whisper does for one.

A hop of 320 samples instead of 160 halves the frames. While learning, the hop varies (the pace of
speech), the filters shift (the length of the speaker's throat) and a gain over frequency is added
(the microphone): voices that no engine has.
"""

from functools import cache
from typing import Final

import numpy as np
import torch
from torch import Tensor

from training.speech.network import MELS

HOP: Final = 320
N_FFT: Final = 400
TAIL_SAMPLES: Final = 160
"""Zeros that faster-whisper puts behind every wave."""
WARPS: Final = tuple(float(value) for value in np.linspace(0.84, 1.18, 18))
_RATE_HZ: Final = 16_000
_LINEAR_HZ_PER_MEL, _LOG_FROM_HZ = 200.0 / 3, 1000.0
_LOG_STEP: Final = np.log(6.4) / 27.0
_LARGEST_MEL: Final = 45.245640471924965


def mel_filters(warp: float = 1.0) -> Tensor:
    """Return Slaney's filters (mel, frequency) with their frequencies times `warp`."""
    mels = np.linspace(0.0, _LARGEST_MEL, MELS + 2)
    hertz = _LINEAR_HZ_PER_MEL * mels
    high = mels >= _LOG_FROM_HZ / _LINEAR_HZ_PER_MEL
    hertz[high] = _LOG_FROM_HZ * np.exp(
        _LOG_STEP * (mels[high] - _LOG_FROM_HZ / _LINEAR_HZ_PER_MEL)
    )
    bins = np.fft.rfftfreq(N_FFT, 1 / _RATE_HZ) / warp
    steps = np.diff(hertz)
    ramps = hertz[:, None] - bins[None, :]
    rising, falling = -ramps[:-2] / steps[:-1, None], ramps[2:] / steps[1:, None]
    weights = np.maximum(0.0, np.minimum(rising, falling))
    weights *= (2.0 / (hertz[2:] - hertz[:-2]))[:, None]
    return torch.from_numpy(weights.astype(np.float32))


@cache
def _bank() -> Tensor:
    return torch.stack([mel_filters(warp) for warp in WARPS])


@cache
def _window() -> Tensor:
    return torch.hann_window(N_FFT, periodic=True)


def powers(waves: Tensor, hop: int = HOP) -> Tensor:
    """Return the power (clip, frequency, frame) of waves (clip, sample)."""
    padded = torch.nn.functional.pad(waves, (0, TAIL_SAMPLES))
    spectra = torch.stft(padded, N_FFT, hop, window=_window(), return_complex=True)
    return spectra[..., :-1].abs().square()


def frames(
    waves: Tensor,
    counts: Tensor,
    hop: int = HOP,
    warps: Tensor | None = None,
    gains: Tensor | None = None,
) -> Tensor:
    """Return frames (clip, mel, frame) of waves of which each has its own count of samples.

    `warps` are numbers of WARPS, `gains` (clip, mel) add to the logarithm of ten. What lies behind
    a clip's end is zero, as faster-whisper pads.
    """
    filters = mel_filters()[None] if warps is None else _bank()[warps]
    logs = (filters @ powers(waves, hop)).clamp_min(1e-10).log10()
    if gains is not None:
        logs = logs + gains[..., None]
    inside = torch.arange(logs.shape[2])[None] < ((counts + TAIL_SAMPLES) // hop)[:, None]
    inside = inside[:, None]
    loudest = logs.masked_fill(~inside, -10.0).amax((1, 2), keepdim=True)
    return ((torch.maximum(logs, loudest - 8.0) + 4.0) / 4.0).masked_fill(~inside, 0.0)
