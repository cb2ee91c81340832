"""Be what all emulated drives share: supply, motor, encoder, the step with the physics, faults."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import can

from drivers.clock import NS_PER_S
from sim_twin.can.power_stage import MotorSpec, PowerStage, ShaftEncoder, Trip


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorMounting:
    """Say how a motor turns its joint.

    `sign` is -1 where its positive direction turns the joint backwards, `gear_ratio` motor turns
    per joint turn, `counts_per_rev` its encoder's. Without a motor it is that of a hub, or the
    faster one that does the same by the gear. `kv` and `ki` are the velocity loop's gains as the
    joint feels them, in N·m·s/rad and N·m/rad.
    """

    sign: int = 1
    counts_per_rev: int = 16384
    gear_ratio: float = 1.0
    motor: MotorSpec | None = None
    kv: float = 8.0
    ki: float = 20.0

    @property
    def motor_gains(self) -> tuple[float, float]:
        """Return the loop's gains as the motor's shaft has them."""
        return self.kv / self.gear_ratio**2, self.ki / self.gear_ratio**2


HUB_MOTOR: Final = MotorMounting()
LOAD_PERIOD_S: Final = 0.01
"""How often supply and heat are followed up, which are slow beside the velocity loop."""


class EmulatedDrive(ABC):
    """Turn one joint; a subclass speaks the protocol and decides on the torque.

    The joint's loop is stable where kv · step < 2 · (wheel inertia + armature).
    """

    def __init__(self, node_id: int, mounting: MotorMounting) -> None:
        self.node_id = node_id
        self._per_joint = mounting.sign * mounting.gear_ratio
        self._stage = PowerStage(mounting.motor or MotorSpec().behind_gear(mounting.gear_ratio))
        self._encoder = ShaftEncoder(mounting.counts_per_rev)
        self._send_frame: Callable[[can.Message], None] = lambda frame: None
        self._now_ns: int | None = None
        self._unfollowed_s = 0.0
        self._supplied = True
        self._silent = False
        self._runaway_rad_s = 0.0
        self._tripped: Trip | None = None

    @property
    def supplied(self) -> bool:
        """Return whether the drive has power."""
        return self._supplied

    @property
    def temperature_c(self) -> float:
        """Return the winding's temperature, for tests and for the referee."""
        return self._stage.temperature_c

    @property
    @abstractmethod
    def armed(self) -> bool:
        """Return whether the power stage is switched on."""

    @property
    @abstractmethod
    def faulted(self) -> bool:
        """Return whether an error holds the drive."""

    @abstractmethod
    def receive(self, frame: can.Message) -> None:
        """Take one frame from the wire."""

    @abstractmethod
    def raise_fault(self, code: int, error_register: int = 0x01) -> None:
        """Fail with one of the protocol's error codes, as a real cause would."""

    @abstractmethod
    def _boot(self) -> None:
        """Start with everything at its defaults."""

    @abstractmethod
    def _act(self, now_ns: int, dt_s: float, velocity_rad_s: float) -> float:
        """Return the motor's torque for the next step."""

    @abstractmethod
    def _trip(self, cause: Trip) -> None:
        """Protect the motor."""

    def connect(self, send: Callable[[can.Message], None]) -> None:
        """Remember how to put a frame on the wire, and boot."""
        self._send_frame = send
        self._boot()

    def advance(self, now_ns: int, position_rad: float, velocity_rad_s: float) -> float:
        """Take the joint's state at `now_ns` and return the torque on the joint in N·m."""
        dt_s = 0.0 if self._now_ns is None else (now_ns - self._now_ns) / NS_PER_S
        self._now_ns = now_ns
        stage, per_joint = self._stage, self._per_joint
        if not self._supplied:
            if not stage.at_rest:
                stage.load(0.0, 0.0, dt_s)
            return 0.0
        velocity_rad_s *= per_joint
        self._encoder.measure(per_joint * position_rad, velocity_rad_s)
        felt_rad_s = velocity_rad_s
        if self._runaway_rad_s and self.armed:
            felt_rad_s -= per_joint * self._runaway_rad_s
        torque_nm = self._act(now_ns, dt_s, felt_rad_s)
        self._unfollowed_s += dt_s
        if self._unfollowed_s >= LOAD_PERIOD_S:
            if torque_nm or not stage.at_rest:
                stage.load(torque_nm, velocity_rad_s, self._unfollowed_s)
            self._unfollowed_s = 0.0
        if stage.is_strained or self._tripped is not None:
            self._protect()
        return per_joint * torque_nm

    def _protect(self) -> None:
        """Trip on a new cause, and on a lasting one where the fault was reset."""
        armed = self.armed
        if self._stage.at_rest and not armed:
            return
        cause = self._stage.trip(armed)
        if cause is not None and (cause is not self._tripped or not self.faulted):
            self._trip(cause)
        self._tripped = cause

    @property
    def supply_w(self) -> float:
        """Return the power that the motor draws; negative while it brakes into the supply."""
        return self._stage.bus_current_a * self._stage.bus_v

    def set_supply(self, on: bool) -> None:
        """Switch the drive's supply: off is silent and without torque, on boots anew."""
        if on and not self._supplied:
            self._supplied = True
            self._boot()
        elif not on:
            self._supplied = False
            self._encoder.lose_supply()

    def set_supply_v(self, volts: float) -> None:
        """Change the supply's voltage; below what the electronics need, the drive is off."""
        self._stage.supply(volts)
        self.set_supply(on=volts >= self._stage.spec.logic_v)

    def set_node_id(self, node_id: int) -> None:
        """Give the drive another address, taken over by a restart."""
        self.node_id = node_id
        self.set_supply(on=False)
        self.set_supply(on=True)

    def freeze(self, on: bool) -> None:
        """Stick the encoder's and the torque's values as they are told, or free them."""
        self._encoder.frozen = on

    def silence(self, on: bool) -> None:
        """Send nothing, or speak again; the drive goes on listening and acting."""
        self._silent = on

    def run_away(self, velocity_rad_s: float) -> None:
        """Turn the joint this much faster than told while power is on; 0 ends it."""
        self._runaway_rad_s = velocity_rad_s

    def overheat(self) -> None:
        """Heat the motor beyond its limit; it trips, and cools down by itself."""
        self._stage.overheat()

    def cool(self) -> None:
        """Bring the motor to the temperature of the room."""
        self._stage.temperature_c = self._stage.spec.ambient_c

    def overload(self, on: bool) -> None:
        """Let the full current flow without moving anything, as in a jammed gear; I²t trips."""
        self._stage.jam(on)

    def _transmit(self, can_id: int, data: bytes) -> None:
        if not self._silent:
            self._send_frame(can.Message(arbitration_id=can_id, is_extended_id=False, data=data))
