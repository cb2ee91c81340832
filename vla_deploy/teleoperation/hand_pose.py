"""Declare what every way to move a robot by hand gives: where its joints shall be now."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HandPose:
    """Hold where joints shall be and how fast that moves, in the robot's units and joint order."""

    position: Floats
    velocity: Floats


class HandInput(Protocol):
    """Be moved by a person."""

    @property
    def joints(self) -> Sequence[str]:
        """Return the joints that it moves; the others stay."""
        ...

    def read(self) -> HandPose | None:
        """Return where the joints shall be, or None where nothing new is known.

        Raises:
            HandMotionEnded: it is lost, or not to be believed.
        """
        ...
