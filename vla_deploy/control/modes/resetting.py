"""Carry out a reset: remove what it may remove, then wait for the judge to say that it is gone."""

from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.control.output.base_drive import BaseDrive
from vla_deploy.control.output.servos import ServoLine
from vla_deploy.safety import ResetOutcome

RESET_NS: Final = 2 * NS_PER_S


class Resetting:
    """Hold the reset that is under way; it moves nothing and arms nothing.

    An arm that pressed on something when its Bus Watchdog stopped it goes on pressing, and takes no
    goal. Where a contact is the cause it is taken over, joint by joint, and held where it is, by as
    much as its weight needs.
    """

    def __init__(self, servos: ServoLine, wheels: BaseDrive) -> None:
        self._servos = servos
        self._wheels = wheels
        self._until_ns: int | None = None
        self._queue: list[int] = []

    @property
    def under_way(self) -> bool:
        """Return whether the judge is to be asked, or a joint still to be taken over."""
        return self._until_ns is not None or bool(self._queue)

    @property
    def asks(self) -> bool:
        """Return whether the judge is to be asked."""
        return self._until_ns is not None

    def begin(self, now_ns: int, *, stopping: bool, met: bool) -> str:
        """Give the devices time to say that their fault is gone; return why not, or nothing.

        `met` says that the robot stands because it has met something.
        """
        if stopping:
            return "reset refused: the stop has not ended yet"
        held_by = self._servos.faulted_but_holding
        if held_by:
            joints = ", ".join(held_by)
            return (
                f"reset refused: it would reboot {joints}, which still hold torque and would fall; "
                "support the arm, disarm, then reset"
            )
        self._until_ns = now_ns + RESET_NS
        if self._servos.state.error.any():
            self._servos.reboot_faulted()
        self._wheels.reset_fault()
        if met:
            self._begin_taking_over()
        return ""

    def step(self) -> str:
        """Take over one servo, so that the bus cycle never waits; return why not, or nothing."""
        if not self._queue or self._servos.energise(self._queue.pop(0)):
            return ""
        self._queue = []
        return f"reset: an arm that holds by itself is not taken over: {self._servos.failure}"

    def _begin_taking_over(self) -> None:
        state = self._servos.state
        if not (self._servos.watchdog_tripped & state.torque_on).any():
            return
        if self._servos.clear_watchdogs():  # those of the others too: all are armed anew
            self._queue = [int(n) for n in self._servos.unguarded if state.torque_on[n]]

    def note(self, now_ns: int, outcome: ResetOutcome, *, estop_asked: bool) -> str:
        """Take in what the judge made of it; return why it is given up, or nothing."""
        if estop_asked:
            self._queue = []
        if self._until_ns is None:
            return ""
        if outcome is ResetOutcome.DONE:
            self._until_ns = None
        elif estop_asked or now_ns >= self._until_ns:
            self._until_ns = None
            return "reset refused: the cause is still there"
        return ""
