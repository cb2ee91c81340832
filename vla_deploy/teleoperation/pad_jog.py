"""Jog the arm or drive the base by a gamepad, as long as its left shoulder button is held."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from drivers.clock import Clock
from drivers.errors import DriverError
from drivers.estop.input_device import InputDevice
from drivers.gamepad import Gamepad, PadAxis, PadButton
from vla_deploy.teleoperation.driving import DriveWish
from vla_deploy.teleoperation.errors import HandMotionEnded, InputUnusable
from vla_deploy.teleoperation.jogging import JogWish

FOLDER: Final = Path("/dev/input/by-id")
PATTERN: Final = "*-event-joystick"
# What moves the arm's joints, the first of them first; a stick pushed away or to the left is plus.
_ARM_AXES: Final = (
    PadAxis.LEFT_X,
    PadAxis.LEFT_Y,
    PadAxis.RIGHT_Y,
    PadAxis.CROSS_Y,
    PadAxis.RIGHT_X,
    PadAxis.CROSS_X,
)


class PadJog:
    """Ask for what the sticks say; with the right shoulder held, for motion of the hand."""

    def __init__(self, pad: Gamepad, joints: Sequence[str], grippers: Collection[str]) -> None:
        self._pad = pad
        self._arm = [one for one in joints if one not in grippers]
        self._grippers = [one for one in joints if one in grippers]

    def wish(self) -> JogWish:
        """Return what is asked for now; nothing while the left shoulder button is up.

        Raises:
            HandMotionEnded: the gamepad is lost.
        """
        pad = self._pad
        if not _is_permitted(pad):
            return JogWish()
        grip = pad.axis(PadAxis.LEFT_TRIGGER) - pad.axis(PadAxis.RIGHT_TRIGGER)
        joints = {one: grip for one in self._grippers if grip}
        if pad.is_held(PadButton.RIGHT_SHOULDER):
            wanted = [PadAxis.LEFT_Y, PadAxis.LEFT_X, PadAxis.RIGHT_Y]
            x, y, z = (-pad.axis(one) for one in wanted)
            return JogWish(joints=joints, hand=(x, y, z))
        for joint, axis in zip(self._arm, _ARM_AXES, strict=False):
            if value := pad.axis(axis):
                joints[joint] = -value
        return JogWish(joints=joints)


class PadDrive:
    """Ask for what the sticks say: the left one ahead, back and sideways, the right one turns."""

    def __init__(self, pad: Gamepad) -> None:
        self._pad = pad

    def wish(self) -> DriveWish:
        """Return what is asked for now; nothing while the left shoulder button is up.

        Raises:
            HandMotionEnded: the gamepad is lost.
        """
        if not _is_permitted(self._pad):
            return DriveWish()
        wanted = [PadAxis.LEFT_Y, PadAxis.RIGHT_X, PadAxis.LEFT_X]
        ahead, turn, left = (-self._pad.axis(one) for one in wanted)
        return DriveWish(ahead=ahead, turn=turn, left=left)


def _is_permitted(pad: Gamepad) -> bool:
    """Return whether the dead-man button is held.

    Raises:
        HandMotionEnded: the gamepad is lost.
    """
    try:
        pad.poll()
    except DriverError as error:
        raise HandMotionEnded(f"the gamepad is lost: {error}") from error
    return pad.is_held(PadButton.LEFT_SHOULDER)


@contextmanager
def gamepad_at(path: Path, clock: Clock) -> Iterator[Gamepad]:
    """Open a gamepad for a `with` block: the one that is plugged in, where the path is empty.

    Raises:
        InputUnusable: there is none, there are several, or it may not be read.
    """
    path = _only_one() if path == Path() else path
    try:
        device = InputDevice(path, clock)
    except DriverError as error:
        why = error.__cause__ or error
        raise InputUnusable(
            f"--gamepad {path}: {why}; plug it in, or add the user to the group input and log in "
            "again"
        ) from error
    pad = Gamepad(device, device.axis_range)
    try:
        yield pad
    finally:
        pad.close()


def _only_one() -> Path:
    found = sorted(FOLDER.glob(PATTERN))
    if len(found) != 1:
        raise InputUnusable(
            f"--gamepad: expected one {FOLDER / PATTERN}, got "
            f"{', '.join(map(str, found)) or 'none'}; name its path: --gamepad /dev/input/eventN"
        )
    return found[0]
