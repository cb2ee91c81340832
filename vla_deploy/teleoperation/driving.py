"""Drive the base by keys or sticks: a velocity that holds for a moment, and is asked for anew.

Control bounds, ramps and judges it as that of any drive. Who asks is a `DriveInput`; it asks for
rest as soon as its dead-man control is let go.
"""

from dataclasses import dataclass
from typing import Final, Protocol

from vla_deploy.ipc import CellWriter
from vla_deploy.robots.description import BaseGeometry

DRIVE_PERIOD_S: Final = 0.05
HOLDS_S: Final = 0.2
"""How long a velocity holds: a driver that was killed leaves a base that brakes after this."""
SPEED_RATIO: Final = 0.5
"""Of the base's top speeds, with a key held or a stick at its end, unless told otherwise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveWish:
    """Say what is asked for, each from -1 to 1: ahead, counter-clockwise, to the left."""

    ahead: float = 0.0
    turn: float = 0.0
    left: float = 0.0


class DriveInput(Protocol):
    """Declare what a keyboard and a gamepad give."""

    def wish(self) -> DriveWish:
        """Return what is asked for now; nothing without the dead-man control.

        Raises:
            HandMotionEnded: it is lost.
        """
        ...


class BaseDriver:
    """Pass on to control what an input asks of the base."""

    def __init__(
        self,
        base: BaseGeometry,
        command: CellWriter,
        source: DriveInput,
        speed_ratio: float = SPEED_RATIO,
    ) -> None:
        self.told = 0
        self._command = command
        self._source = source
        self._m_s = speed_ratio * base.max_speed_m_s
        self._rad_s = speed_ratio * base.max_turn_rad_s
        self._left_m_s = self._m_s if base.is_holonomic else 0.0

    def step(self) -> DriveWish:
        """Pass on what is asked for now, and return it.

        Raises:
            HandMotionEnded: the input is lost.
        """
        wish = self._source.wish()
        self._put(wish, HOLDS_S)
        self.told += wish != DriveWish()
        return wish

    def stop(self) -> None:
        """Ask for rest, and for nothing more."""
        self._put(DriveWish(), 0.0)

    def _put(self, wish: DriveWish, valid_s: float) -> None:
        self._command.put(
            v_m_s=self._m_s * wish.ahead,
            w_rad_s=self._rad_s * wish.turn,
            left_m_s=self._left_m_s * wish.left,
            valid_s=valid_s,
        )
