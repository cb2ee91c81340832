"""Define the network: plain 3x3 convolutions with ReLU, heat and boxes at an eighth of the size."""

import torch
from torch import Tensor, nn

from training.detector.targets import STRIDE_PX

THING_PRIOR = -4.0
SIZE_LOG_RANGE = (-2.0, 4.6)
"""Bounds of ln(side of a box / stride)."""
FIRST_SIZE_LOG = 1.3
QUARTER, EIGHTH, SIXTEENTH, WIDE, JOINED = 32, 112, 256, 160, 128
"""Channels at each size."""


def _block(inputs: int, outputs: int, stride: int = 1, spread: int = 1) -> nn.Sequential:
    return _activated(nn.Conv2d(inputs, outputs, 3, stride, spread, spread, bias=False))


def _activated(convolution: nn.Conv2d) -> nn.Sequential:
    return nn.Sequential(
        convolution, nn.BatchNorm2d(convolution.out_channels), nn.ReLU(inplace=True)
    )


class CentreNet(nn.Module):
    """Predict for each cell of 8 x 8 pixels how likely a thing's middle is there, and its box.

    `image` is N x 3 x H x W, RGB from 0 to 1, H and W multiples of 32. The outputs are `heat`,
    N x classes x H/8 x W/8 from 0 to 1, and `edges`, N x 4 x H/8 x W/8: distances in pixels from
    the cell's centre to the left, top, right and bottom edge.
    """

    def __init__(self, classes: int) -> None:
        super().__init__()
        # One step to a quarter: maps of half the size would take a third of all time, and tell no
        # more of things of 16 px and up.
        self.stem = _activated(nn.Conv2d(3, QUARTER, 6, 4, 1, bias=False))
        self.quarter = _block(QUARTER, QUARTER)
        self.eighth = nn.Sequential(
            _block(QUARTER, EIGHTH, 2), _block(EIGHTH, EIGHTH), _block(EIGHTH, EIGHTH)
        )
        self.sixteenth = nn.Sequential(
            _block(EIGHTH, SIXTEENTH, 2),
            _block(SIXTEENTH, SIXTEENTH, spread=2),
            _block(SIXTEENTH, SIXTEENTH, spread=3),
            _block(SIXTEENTH, SIXTEENTH),
        )
        # Sees the whole image at once: a person nearby is as high as that.
        self.wide = nn.Sequential(
            _block(SIXTEENTH, WIDE, 2), _block(WIDE, WIDE, spread=2), _block(WIDE, WIDE)
        )
        self.from_eighth = nn.Conv2d(EIGHTH, JOINED, 1)
        self.to_eighth = nn.Conv2d(SIXTEENTH, JOINED, 1)
        self.from_wide = nn.Conv2d(WIDE, JOINED, 1)
        self.grow = nn.Upsample(scale_factor=2, mode="nearest")
        self.join = nn.Sequential(_block(JOINED, JOINED), _block(JOINED, JOINED))
        self.last = nn.Conv2d(JOINED, 1 + classes + 4, 1)
        with torch.no_grad():
            # What sees far adds nothing at first.
            self.from_wide.weight.zero_()
            assert self.from_wide.bias is not None
            self.from_wide.bias.zero_()
            assert self.last.bias is not None
            first = [THING_PRIOR] + [0.0] * classes + [0.0, 0.0, FIRST_SIZE_LOG, FIRST_SIZE_LOG]
            self.last.bias.copy_(torch.tensor(first))

    def raw(self, image: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return logits of whether something is there and of its name, and edges in pixels."""
        eighth = self.eighth(self.quarter(self.stem(image)))
        sixteenth = self.sixteenth(eighth)
        far = self.to_eighth(sixteenth) + self.grow(self.from_wide(self.wide(sixteenth)))
        joined = self.join(self.from_eighth(eighth) + self.grow(far))
        with torch.autocast(joined.device.type, enabled=False):
            last = self.last(joined.float())
        return last[:, :1], last[:, 1:-4], _edges(last[:, -4:])

    def forward(self, image: Tensor) -> tuple[Tensor, Tensor]:
        """Return heat and edges."""
        things, names, edges = self.raw(image)
        return torch.sigmoid(things) * torch.softmax(names, dim=1), edges


def _edges(boxes: Tensor) -> Tensor:
    """Return distances to the edges from the way to the box's middle and its sides' logarithms."""
    middle = boxes[:, :2] * STRIDE_PX
    half = 0.5 * STRIDE_PX * torch.exp(boxes[:, 2:].clamp(*SIZE_LOG_RANGE))
    return torch.cat([half - middle, half + middle], dim=1)
