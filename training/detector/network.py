"""Define the network: plain 3x3 convolutions with ReLU, heat and boxes at a quarter of the size."""

import torch
from torch import Tensor, nn

from training.detector.targets import STRIDE_PX

HEAT_PRIOR = -4.0
BOX_LOG_RANGE = (-2.0, 4.6)
"""Bounds of ln(distance to an edge / stride)."""


def _block(inputs: int, outputs: int, stride: int = 1, spread: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, spread, spread, bias=False),
        nn.BatchNorm2d(outputs),
        nn.ReLU(inplace=True),
    )


class CentreNet(nn.Module):
    """Tell for each cell of 4 x 4 pixels how likely a thing's centre is there, and its box.

    `image` is N x 3 x H x W, RGB from 0 to 1, H and W multiples of 16. The outputs are `heat`,
    N x classes x H/4 x W/4 from 0 to 1, and `edges`, N x 4 x H/4 x W/4: distances in pixels from
    the cell's centre to the left, top, right and bottom edge.
    """

    def __init__(self, classes: int) -> None:
        super().__init__()
        self.stem = _block(3, 16, 2)
        self.quarter = nn.Sequential(_block(16, 32, 2), _block(32, 32))
        self.eighth = nn.Sequential(_block(32, 64, 2), _block(64, 64), _block(64, 64))
        # Spread kernels see a whole person without a level at 1/32, which does not divide 240 rows.
        self.sixteenth = nn.Sequential(
            _block(64, 96, 2), _block(96, 96, spread=2), _block(96, 96, spread=3), _block(96, 96)
        )
        self.to_eighth = nn.Conv2d(96, 64, 1)
        self.to_quarter = nn.Conv2d(64, 40, 1)
        self.from_quarter = nn.Conv2d(32, 40, 1)
        self.join_eighth = _block(64, 64)
        self.join_quarter = _block(40, 40)
        self.grow = nn.Upsample(scale_factor=2, mode="nearest")
        self.last = nn.Conv2d(40, classes + 4, 1)
        with torch.no_grad():
            assert self.last.bias is not None
            self.last.bias.copy_(torch.tensor([HEAT_PRIOR] * classes + [1.0] * 4))
        self.classes = classes

    def raw(self, image: Tensor) -> tuple[Tensor, Tensor]:
        """Return logits of the heat and logarithms of the edges in strides."""
        quarter = self.quarter(self.stem(image))
        eighth = self.eighth(quarter)
        sixteenth = self.sixteenth(eighth)
        eighth = self.join_eighth(eighth + self.grow(self.to_eighth(sixteenth)))
        fine = self.join_quarter(self.from_quarter(quarter) + self.grow(self.to_quarter(eighth)))
        with torch.autocast(fine.device.type, enabled=False):
            last = self.last(fine.float())
        return last[:, : self.classes], last[:, self.classes :]

    def forward(self, image: Tensor) -> tuple[Tensor, Tensor]:
        """Return heat and edges."""
        heat, edges = self.raw(image)
        return torch.sigmoid(heat), STRIDE_PX * torch.exp(edges.clamp(*BOX_LOG_RANGE))
