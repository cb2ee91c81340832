"""Run the cycle that all buses of wheel drives share; a protocol adds its frames."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Generic, TypeVar

import can
import numpy as np
from numpy.typing import NDArray

from drivers.can.link import CanLink
from drivers.clock import Clock
from drivers.errors import LinkLost, ProtocolError
from drivers.stepping import wait_for
from drivers.wheel_drives.bus import DriveGoal, DriveState, PowerState, ResetRule
from drivers.wheel_drives.cyclic_port import CyclicPort
from drivers.wheel_drives.goal import DrivesSeen, GoalKeeper
from drivers.wheel_drives.node_budget import NodeBudget

STILL_RAD_S = 0.05
_WITH_POWER = (PowerState.OPERATION_ENABLED, PowerState.QUICK_STOP_ACTIVE)


P = TypeVar("P", bound=CyclicPort)


class DriveCycle(ABC, Generic[P]):
    """Keep goal, budgets and state of all drives of one bus."""

    def __init__(self, bus: can.BusABC, clock: Clock, ports: Sequence[P]) -> None:
        """Take the bus over.

        Raises:
            ValueError: two drives share a node id.
        """
        node_ids = [port.spec.node_id for port in ports]
        if len(set(node_ids)) != len(node_ids):
            raise ValueError(f"two drives share a node id: {node_ids}; correct the robot file")
        self._clock = clock
        self._link = CanLink(bus, clock)
        self._ports = tuple(ports)
        self._budget = NodeBudget([port.spec.joint for port in ports])
        self._goals = GoalKeeper()
        self._closed = False
        self._every_enabled = [PowerState.OPERATION_ENABLED] * len(self._ports)

    def connect(self) -> None:
        """Do all of `connecting`, waiting in between.

        Raises:
            DriverError: as `connecting` does.
        """
        wait_for(self.connecting(), self._clock)

    @abstractmethod
    def connecting(self) -> Iterator[None]:
        """Check and configure every drive step by step; all end up disabled."""

    def _start_over(self) -> None:
        """Forget what an earlier connection has left, frames that still wait included."""
        self._goals.disable()
        self._budget.forget()
        self._take_frames()

    @property
    def counters(self) -> dict[str, int]:
        """Return what the bus has carried and lost since it was opened."""
        return self._link.counters | self._budget.counters

    @property
    def enabled(self) -> bool:
        """Return whether every drive follows its velocity and is meant to."""
        return self._goals.goal is DriveGoal.ENABLED and self._all_enabled()

    def _all_enabled(self) -> bool:
        # Asked several times a tick: a generator would take three times as long.
        return [port.power_state for port in self._ports] == self._every_enabled

    def enable(self) -> None:
        """Begin to power all drives; `enabled` tells when they follow."""
        self._goals.enable()

    def disable(self) -> None:
        """Take the power off all drives; moving wheels coast."""
        self._goals.disable()

    def cut_power(self) -> None:
        """Take the power off all drives at once, as a stop of category 0 asks."""
        self._goals.disable()

    def quick_stop(self) -> None:
        """Let all drives brake on their ramp and then take their power off."""
        self._goals.quick_stop(self._clock.now_ns())

    def reset_fault(self) -> tuple[str, ...]:
        """Take back what faults may be taken back; the drives stay disabled.

        Return, in words, which of them no reset may take back.
        """
        self._goals.reset_fault(self._clock.now_ns())
        return tuple(
            f"{port.spec.name}: {port.fault.text} is reset {ResetRule.NEVER.value}"
            for port in self._ports
            if port.faulted and port.fault is not None and port.fault.rule is ResetRule.NEVER
        )

    def cycle(self, velocity_rad_s: NDArray[np.float64] | None) -> DriveState:
        """Read what has arrived, send setpoints and return the drives' state.

        Velocities are the joints', in the order of the specs; None, or drives that are not all
        enabled, sends zero.

        Raises:
            LinkLost: the bus has gone.
            ValueError: a velocity is not finite.
        """
        wanted = None if velocity_rad_s is None else _finite(velocity_rad_s)
        now_ns = self._clock.now_ns()
        self._take_frames()
        self._budget.note_cycle(self._missing(now_ns), now_ns)
        lost = self._lost(now_ns)
        self._goals.advance(self._seen(lost), now_ns)
        self._send(wanted if self.enabled else None, now_ns)
        return self._state(lost, now_ns)

    def _take_frames(self) -> bool:
        """Hand out what has arrived and tell whether it was for us."""
        heard = False
        now_ns = self._clock.now_ns()
        for frame in self._link.drain():
            try:
                heard |= self._hear(frame.arbitration_id, bytes(frame.data), now_ns)
            except ProtocolError:
                self._link.frames_malformed += 1
        return heard

    @abstractmethod
    def _hear(self, can_id: int, data: bytes, now_ns: int) -> bool:
        """Take one frame; tell whether it was for us."""

    @abstractmethod
    def _missing(self, now_ns: int) -> list[int]:
        """Return the rows of the drives that did not answer the last cycle."""

    @abstractmethod
    def _send(self, velocity_rad_s: NDArray[np.float64] | None, now_ns: int) -> None:
        """Send setpoints, None for zero, and what leads to the goal."""

    @abstractmethod
    def _farewell(self) -> None:
        """Send what leaves the drives without power."""

    def _lost(self, now_ns: int) -> tuple[bool, ...]:
        over_budget = self._budget.lost
        return tuple(port.lost(now_ns) or over_budget[row] for row, port in enumerate(self._ports))

    def _seen(self, lost: Sequence[bool]) -> DrivesSeen:
        return DrivesSeen(
            all_enabled=self._all_enabled(),
            any_lost=any(lost),
            any_faulted=any(port.faulted for port in self._ports),
            any_braking=any(map(self._brakes, self._ports)),
        )

    def _brakes(self, port: P) -> bool:
        """Return whether a wheel still has to be braked, as far as its drive has told."""
        return port.power_state in _WITH_POWER and abs(port.velocity_rad_s) >= STILL_RAD_S

    def _state(self, lost: tuple[bool, ...], now_ns: int) -> DriveState:
        ports = self._ports
        position_rad, velocity_rad_s, torque_nm, age_s = np.array(
            (
                [port.position_rad for port in ports],
                [port.velocity_rad_s for port in ports],
                [port.torque_nm for port in ports],
                [port.age_s(now_ns) for port in ports],
            )
        )
        return DriveState(
            position_rad=position_rad,
            velocity_rad_s=velocity_rad_s,
            torque_nm=torque_nm,
            age_s=age_s,
            power_state=tuple(self._power_state(port) for port in ports),
            lost=lost,
            faulted=tuple(port.faulted for port in ports),
            fault=tuple(port.fault for port in ports),
            enabled=self.enabled,
        )

    def _power_state(self, port: P) -> PowerState:
        return port.power_state

    def close(self) -> None:
        """Leave the drives without power and leave the bus; closing twice is allowed."""
        if self._closed:
            return
        self._closed = True
        try:
            self._farewell()
        except LinkLost:
            # Nobody can be told any more: the drives stop for want of our frames.
            self._link.frames_dropped += len(self._ports)
        self._link.close()


def _finite(velocity_rad_s: NDArray[np.float64]) -> NDArray[np.float64]:
    if not all(map(math.isfinite, velocity_rad_s.tolist())):
        raise ValueError(f"velocities {velocity_rad_s.tolist()} rad/s: NaN or infinite")
    return velocity_rad_s
