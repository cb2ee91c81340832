"""Let a sound arrive at a twin's microphone, and say when its words begin and end."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S
from sim_twin.sound.talker import Arrival
from sim_twin.twin import Twin

_LEAD_NS: Final = NS_PER_S // 50
"""Sound is laid a little ahead: what the microphone has sent already cannot be added to."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spoken:
    """Say when somebody's words arrive, in simulated time."""

    begins_ns: int
    ends_ns: int


def let_arrive(twin: Twin, arrival: Arrival) -> Spoken:
    """Lay a sound into the twin's room, now.

    Raises:
        ModelMismatch: the robot has no microphone.
    """
    room = twin.microphone.room
    starts = room.row_at(twin.now_ns + _LEAD_NS)
    room.lay(arrival.sound.wave, starts)
    first, end = (round((starts + row) * NS_PER_S / room.rate_hz) for row in arrival.words)
    return Spoken(begins_ns=first, ends_ns=end)


def ear_position_m(twin: Twin) -> NDArray[np.float64]:
    """Return where the robot listens, map frame (3,): at its head camera."""
    site = twin.engine.model.site(twin.robot.camera.site).id
    position: NDArray[np.float64] = twin.engine.data.site_xpos[site].copy()
    return position
