"""Read keys from the terminal. A terminal tells no release: a key counts for a moment only."""

import os
import select
import sys
import termios
import tty
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Final, Generic, TypeVar

from drivers.clock import NS_PER_S, Clock
from vla_deploy.teleoperation.driving import DriveWish
from vla_deploy.teleoperation.errors import HandMotionEnded, InputUnusable
from vla_deploy.teleoperation.jogging import JogWish

DEAD_MAN_S: Final = 0.3
"""A key that is not pressed again, by hand or by the terminal's repeat, stops after this."""
_UPPER: Final = "1234567890"
_LOWER: Final = "qwertyuiop"
HAND_KEYS: Final[Mapping[bytes, tuple[float, float, float]]] = {
    b"\x1b[A": (1.0, 0.0, 0.0),
    b"\x1b[B": (-1.0, 0.0, 0.0),
    b"\x1b[D": (0.0, 1.0, 0.0),
    b"\x1b[C": (0.0, -1.0, 0.0),
    b"\x1b[5~": (0.0, 0.0, 1.0),
    b"\x1b[6~": (0.0, 0.0, -1.0),
}
"""Arrows: forward, back, left, right; page up and page down (ECMA-48 sequences, as xterm's)."""
DRIVE_KEYS: Final[Mapping[bytes, DriveWish]] = {
    b"\x1b[A": DriveWish(ahead=1.0),
    b"\x1b[B": DriveWish(ahead=-1.0),
    b"\x1b[D": DriveWish(turn=1.0),
    b"\x1b[C": DriveWish(turn=-1.0),
}
SIDEWAYS_KEYS: Final[Mapping[bytes, DriveWish]] = {
    b"a": DriveWish(left=1.0),
    b"d": DriveWish(left=-1.0),
}
_READ_BYTES: Final = 256
WishT = TypeVar("WishT")


def key_table(joints: Sequence[str]) -> dict[bytes, JogWish]:
    """Return what each key asks for: a column of two keys moves a joint up and down."""
    table = {key: JogWish(hand=hand) for key, hand in HAND_KEYS.items()}
    for joint, up, down in zip(joints, _UPPER, _LOWER, strict=False):
        table[up.encode()] = JogWish(joints={joint: 1.0})
        table[down.encode()] = JogWish(joints={joint: -1.0})
    return table


def keys_of(joints: Sequence[str]) -> dict[str, str]:
    """Return the two keys of each joint in words."""
    pairs = zip(joints, _UPPER, _LOWER, strict=False)
    return {joint: f"{up} +  {down} -" for joint, up, down in pairs}


class Keyboard(Generic[WishT]):
    """Ask for what the last key asks for, until it was not pressed for `DEAD_MAN_S`."""

    def __init__(
        self, descriptor: int, clock: Clock, table: Mapping[bytes, WishT], nothing: WishT
    ) -> None:
        """Read the keys of `table`; any other asks for `nothing`."""
        self._descriptor = descriptor
        self._clock = clock
        self._table = table
        self._nothing = self._wish = nothing
        self._pressed_ns = clock.now_ns()

    def wish(self) -> WishT:
        """Return what is asked for now; any key without a meaning stops.

        Raises:
            HandMotionEnded: the terminal is gone.
        """
        pressed = self._pressed()
        if pressed is not None:
            self._wish = self._table.get(pressed, self._nothing)
            self._pressed_ns = self._clock.now_ns()
        elif self._clock.now_ns() - self._pressed_ns > DEAD_MAN_S * NS_PER_S:
            self._wish = self._nothing
        return self._wish

    def _pressed(self) -> bytes | None:
        """Return the newest key; a sequence that begins with escape is one."""
        if not select.select([self._descriptor], [], [], 0.0)[0]:
            return None
        try:
            data = os.read(self._descriptor, _READ_BYTES)
        except OSError as error:
            raise HandMotionEnded(f"the terminal is gone: {error.strerror}") from error
        if not data:
            raise HandMotionEnded("the terminal is gone")
        begin = data.rfind(b"\x1b")
        sequence = data[begin:] if begin >= 0 else b""
        return sequence if sequence in self._table else data[-1:]


@contextmanager
def keys_of_terminal(
    clock: Clock, table: Mapping[bytes, WishT], nothing: WishT
) -> Iterator[Keyboard[WishT]]:
    """Read keys unbuffered and unechoed for a `with` block; Ctrl-C stays Ctrl-C.

    Raises:
        InputUnusable: standard input is no terminal.
    """
    if not sys.stdin.isatty():
        raise InputUnusable("--keyboard: expected a terminal at standard input, got a pipe or file")
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield Keyboard(descriptor, clock, table, nothing)
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
