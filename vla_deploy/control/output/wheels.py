"""Keep the wheel drives: open, lose and reopen their bus, drive the base, tell where it went."""

import logging
from collections.abc import Callable, Generator
from math import inf
from typing import Final

import numpy as np

from drivers.clock import NS_PER_S, Clock
from drivers.errors import DriverError, LinkLost
from drivers.stepping import wait_for
from drivers.wheel_drives.bus import DriveBus, DriveState
from vla_deploy.control.motion.base_velocity import STANDING, BaseVelocity
from vla_deploy.control.output.base_kinematics import base_kinematics, within_wheels
from vla_deploy.control.output.drive_samples import drive_samples
from vla_deploy.control.output.odometry import Odometry
from vla_deploy.control.output.wheel_tracking import WheelTracking
from vla_deploy.robots import RobotDescription
from vla_deploy.safety import DriveSample

REOPEN_NS = NS_PER_S
BRAKE_NS = NS_PER_S
_STILL_RAD_S = 0.02
_LOG = logging.getLogger(__name__)


class Wheels:
    """Own the drives of all wheels; a lost link is remembered after `open`.

    `open_bus` gives them anew after each loss, not yet connected.
    """

    has_wheels: Final = True

    def __init__(
        self,
        robot: RobotDescription,
        name: str,
        open_bus: Callable[[], DriveBus],
        clock: Clock,
        *,
        age_limit_s: float,
    ) -> None:
        self.name = name
        self.lost = False
        self.failure = ""
        self.state: DriveState | None = None
        self._open_bus = open_bus
        self._clock = clock
        self._age_limit_s = age_limit_s
        self._joints = robot.wheel_joints
        self._most_rad_s = robot.base.max_wheel_rad_s or inf
        self._geometry = base_kinematics(robot.base)
        self.odometry = Odometry(self._geometry)
        self._tracking = WheelTracking(len(self._joints))
        self.velocity = STANDING
        self._bus: DriveBus | None = None
        self._next_open_ns = 0
        self._followed = False
        self._off_at_ns: int | None = None
        self._reopening: Generator[None, None, None] | None = None

    def open(self) -> None:
        """Reset, check and configure the drives; they end up disabled.

        Raises:
            DriverError: the interface is missing, or a drive is silent or not as declared.
        """
        wait_for(self._connecting(), self._clock)

    def try_reopen(self) -> bool:
        """Go a step towards opening a lost bus again, and tell whether it is back.

        A step never waits, for the servos must not miss their tick; a failed attempt is followed by
        the next one a second after it began.
        """
        if not self.lost:
            return False
        try:
            if self._reopening is None:
                self._begin_reopening()
            else:
                next(self._reopening)
        except StopIteration:
            self._reopening = None
            self.failure = ""
            return True
        except DriverError as error:
            self._reopening = None
            self.failure = str(error)
        return False

    def _begin_reopening(self) -> None:
        now_ns = self._clock.now_ns()
        if now_ns < self._next_open_ns:
            return
        self._next_open_ns = now_ns + REOPEN_NS
        self.close()
        self._reopening = self._connecting()

    def _connecting(self) -> Generator[None, None, None]:
        bus = self._open_bus()
        try:
            yield from bus.connecting()
        except (DriverError, GeneratorExit):
            bus.close()
            raise
        for note in bus.notes:
            _LOG.warning("%s: %s", self.name, note)
        self._bus = bus
        self.lost = False
        self.odometry.forget_wheels()
        self._tracking.forget()

    @property
    def enabled(self) -> bool:
        """Return whether all drives follow the commanded speed."""
        return self._bus is not None and not self.lost and self._bus.enabled

    @property
    def faulted(self) -> bool:
        """Return whether a drive is in a fault state."""
        return self.state is not None and any(self.state.faulted)

    @property
    def still(self) -> bool:
        """Return whether the wheels stand, or cannot be driven any more."""
        if self.lost or self.state is None:
            return True
        return all(abs(speed) < _STILL_RAD_S for speed in self.state.velocity_rad_s.tolist())

    @property
    def counters(self) -> dict[str, int] | None:
        """Return what the bus has counted; empty before it was opened, None on the servo line."""
        return {} if self._bus is None else self._bus.counters

    def samples(self) -> tuple[DriveSample, ...]:
        """Return what the safety judge wants to know of each drive."""
        if self.state is None:
            return ()
        return drive_samples(
            self._joints,
            self.state,
            self._tracking,
            age_limit_s=self._age_limit_s,
            dropped_out=self._dropped_out,
        )

    def within(self, velocity: BaseVelocity) -> BaseVelocity:
        """Return a velocity on the same curve that asks no wheel for more than it may turn."""
        return within_wheels(velocity, self._geometry, self._most_rad_s)

    def cycle(self, v_m_s: float, w_rad_s: float, left_m_s: float = 0.0) -> None:
        """Command a base velocity, take in the drives' state and move the odometry on."""
        if self._bus is None:
            return
        if self.lost:
            self._attend(self._bus)
            return
        if self._off_at_ns is not None and self._clock.now_ns() >= self._off_at_ns:
            self.disable()
        try:
            wanted_rad_s = self._geometry.wheel_speeds(v_m_s, w_rad_s, left_m_s)
            state = self._bus.cycle(np.array(wanted_rad_s))
        except LinkLost as error:
            self.failure = str(error)
            self._note_loss()
            self.velocity = STANDING
            return
        self.state = state
        self._followed = self._followed or state.enabled
        if any(state.lost):
            self._note_loss()
        position_rad = state.position_rad.tolist()
        if state.enabled:
            self._tracking.note(self._clock.now_ns(), wanted_rad_s, position_rad)
        else:
            self._tracking.forget()
        self.odometry.update(*position_rad)
        self.velocity = self._geometry.base_velocity(*state.velocity_rad_s.tolist())

    def _attend(self, bus: DriveBus) -> None:
        """Command drives that were lost to stop until they are connected again.

        A drive that was late, and the one that was never lost, then brake as they are told; without
        our frames they would do so in a fault of their own that hides the cause.
        """
        try:
            bus.cycle(None)
        except LinkLost as error:
            self.failure = str(error)

    @property
    def _dropped_out(self) -> bool:
        """Return whether drives that followed have ceased to, and nobody asked them to."""
        return self._followed and not self.enabled and not self.faulted

    def _note_loss(self) -> None:
        """Leave the drives a second to brake by themselves: the reset to come lets wheels coast."""
        self.lost = True
        self._next_open_ns = self._clock.now_ns() + REOPEN_NS

    def enable(self) -> None:
        """Begin to power the drives; `enabled` tells when they follow."""
        self._followed = False
        self._off_at_ns = None
        if self._bus is not None and not self.lost:
            self._bus.enable()

    def disable(self) -> None:
        """Take the power off all drives."""
        self._followed = False
        self._off_at_ns = None
        if self._bus is not None:
            self._bus.disable()

    def cut_power(self) -> None:
        """Take the power off all drives at once, as a stop of category 0 asks."""
        self.disable()
        if self._bus is None:
            return
        try:
            self._bus.cut_power()
        except LinkLost as error:
            self.failure = str(error)
            self._note_loss()

    def quick_stop(self) -> None:
        """Let the drives brake on their own ramp and then take their power off.

        A drive that does not come to rest within a second loses its power all the same.
        """
        self._followed = False
        self._off_at_ns = self._clock.now_ns() + BRAKE_NS
        if self._bus is not None:
            self._bus.quick_stop()

    def reset_fault(self) -> None:
        """Ask faulted drives to leave their fault; `failure` says which of them may not."""
        self._followed = False
        if self._bus is not None and self.faulted:
            self.failure = "; ".join(self._bus.reset_fault())

    def close(self) -> None:
        """Brake, and leave the bus."""
        if self._reopening is not None:
            self._reopening.close()
            self._reopening = None
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.close()
