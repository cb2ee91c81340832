"""Say how the shafts of a bus turn with the joints that its servos drive."""

from dataclasses import dataclass

import numpy as np

from sim_twin.servos.firmware.profile import Floats


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coupling:
    """Hold one entry a servo: shaft angle = rad_per_joint * joint - zero_rad.

    `zero_rad` may be written to; `ServoBank.couple_anew` takes that over.
    """

    rad_per_joint: Floats
    zero_rad: Floats

    @classmethod
    def direct(cls, count: int) -> "Coupling":
        """Return that of servos whose joints are their shafts."""
        return cls(rad_per_joint=np.ones(count), zero_rad=np.zeros(count))

    @property
    def sign(self) -> Floats:
        """Return the direction of each joint seen from its shaft."""
        sign: Floats = np.sign(self.rad_per_joint)
        return sign
