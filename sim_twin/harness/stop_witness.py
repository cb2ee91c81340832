"""Watch the CAN bus for the frame by which control stops the first wheel drive.

A base that drives is stopped quickly, one that rests loses its power: either way the drive is told
something else than to operate.
"""

from pathlib import Path
from typing import Final

import can

from drivers.can_hub import HubBus
from drivers.canopen.cia402 import ControlCommand
from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.robots import load_robot

ANSWER_S: Final = 1.0
_RPDO1: Final = 0x200
_COMMAND_BITS: Final = 0x0F


class NoStop(Exception):
    """Say that a stop was asked for and nothing came: worse than late."""


class StopWitness:
    """Listen beside the drives of a running twin."""

    def __init__(self, run_dir: Path) -> None:
        line = load_robot("butler").can_bus
        self._cob_id = _RPDO1 + line.drives[0].node_id
        self._bus = HubBus(channel=str(run_dir / "dev" / line.device))
        self._clock = MonotonicClock()

    def operates(self) -> bool:
        """Forget what was on the wire so far; tell whether the drive was last told to operate."""
        operates = False
        while (frame := self._bus.recv(0.0)) is not None:
            if frame.arbitration_id == self._cob_id:
                operates = _lets_operate(frame)
        return operates

    def stop_frame_ns(self, answer_s: float = ANSWER_S) -> int:
        """Return when the drive is first told anything but to operate.

        Raises:
            NoStop: that does not come within `answer_s`.
        """
        deadline_ns = self._clock.now_ns() + round(answer_s * NS_PER_S)
        while self._clock.now_ns() < deadline_ns:
            frame = self._bus.recv(answer_s)
            if frame is None or frame.arbitration_id != self._cob_id:
                continue
            if not _lets_operate(frame):
                return self._clock.now_ns()
        raise NoStop(f"no stop on the wire within {answer_s:g} s of the request")

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()


def _lets_operate(frame: can.Message) -> bool:
    return int(frame.data[0]) & _COMMAND_BITS == ControlCommand.ENABLE_OPERATION
