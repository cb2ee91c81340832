"""Write goals for all servos, converted from the joint side and clamped to the servo's range."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.handshake import ServoSetup
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.tables.control_table import PWM_FULL
from drivers.dynamixel.tables.registers import Registers
from drivers.dynamixel.wire.codec import (
    BROADCAST_ID,
    HEADER,
    STUFFED_PATTERN,
    Instruction,
    crc16,
    encode_instruction,
)
from drivers.dynamixel.wire.link import PacketLink
from drivers.errors import DriverError, LinkLost
from drivers.servo.members import require_goals
from drivers.servo.patience import ReplyPatience

_GOAL: Final = np.dtype([("id", "u1"), ("pulse", "<i4")])
_GOAL_POSITION_HEAD: Final = b"\x74\x00\x04\x00"  # address 116, 4 bytes
_FRAME_HEAD_BYTES: Final = 12  # header .. instruction, address, length
_FRAME_CRC_BYTES: Final = 2

Floats = NDArray[np.float64]


class GoalWriter:
    """Write goal positions in one sync write, and PWM limits when they change."""

    def __init__(
        self,
        link: PacketLink,
        registers: Registers,
        servos: Sequence[ServoSpec],
        setups: Sequence[ServoSetup],
        *,
        margin_s: float,
    ) -> None:
        self._link = link
        self._registers = registers
        self._servos = {servo.id: servo for servo in servos}
        self._joints = [servo.joint for servo in servos]
        self._patience = ReplyPatience(margin_s=margin_s, attempts=2)
        self._per_pulse = np.array([servo.joint_per_pulse for servo in servos])
        self._pulses_per = 1.0 / self._per_pulse
        self._at_pulse_zero = np.array([servo.to_joint(0) for servo in servos])
        self._pulse_at_zero = -self._at_pulse_zero * self._pulses_per
        self._minimum = np.array([float(setup.minimum_pulse) for setup in setups])
        self._maximum = np.array([float(setup.maximum_pulse) for setup in setups])
        low, high = np.sort([self._to_joint(self._minimum), self._to_joint(self._maximum)], axis=0)
        # goals within what all servos can do need no clamping
        self._lowest, self._highest = float(low.max()), float(high.min())
        self._pwm_limit = {
            servo.id: setup.pwm_limit for servo, setup in zip(servos, setups, strict=True)
        }
        self._pwm: dict[int, int] = {}
        self._frame = GoalFrame([servo.id for servo in servos])

    @property
    def sent(self) -> Floats:
        """Return the goals sent last, on the joint side."""
        return self._to_joint(self._frame.pulses)

    def write(self, position_rad: Floats) -> None:
        """Send a goal to every servo.

        Raises:
            ValueError: a goal is not finite, or there is not one per servo.
            LinkLost: the adapter is gone.
        """
        goals = position_rad.tolist()
        if len(goals) != len(self._joints) or not isfinite(sum(goals)):
            require_goals(self._joints, position_rad)
        pulses = position_rad * self._pulses_per
        np.add(pulses, self._pulse_at_zero, pulses)
        np.rint(pulses, pulses)
        if min(goals) < self._lowest or max(goals) > self._highest:
            np.clip(pulses, self._minimum, self._maximum, out=pulses)
        self._link.send(self._frame.of(pulses))

    def write_pwm(self, ratios: Mapping[int, float]) -> dict[int, DriverError]:
        """Limit the PWM of servos, where it changed; return those that did not take it.

        Raises:
            ValueError: a ratio is not within 0..1 or an id is unknown.
            LinkLost: the adapter is gone.
        """
        failures: dict[int, DriverError] = {}
        for servo_id, ratio in ratios.items():
            value = self._pwm_value(servo_id, ratio)
            if self._pwm.get(servo_id) == value:
                continue
            try:
                self._registers.write(self._servos[servo_id], "goal_pwm", value, self._patience)
                self._pwm[servo_id] = value
            except LinkLost:
                raise
            except DriverError as error:
                failures[servo_id] = error
        return failures

    def forget_pwm(self, servo_id: int) -> None:
        """Write the PWM limit anew the next time: the servo has lost it."""
        self._pwm.pop(servo_id, None)

    def _to_joint(self, pulses: NDArray[Any]) -> Floats:
        joint: Floats = pulses * self._per_pulse + self._at_pulse_zero
        return joint

    def _pwm_value(self, servo_id: int, ratio: float) -> int:
        if servo_id not in self._servos:
            raise ValueError(f"no servo {servo_id} on this bus; it has {sorted(self._servos)}")
        if not 0.0 <= ratio <= 1.0:
            raise ValueError(
                f"{self._servos[servo_id]}: PWM ratio must be within 0..1, got {ratio}"
            )
        return min(round(ratio * PWM_FULL), self._pwm_limit[servo_id])


class GoalFrame:
    """Hold the sync write of all goal positions; only `pulses` and CRC change."""

    def __init__(self, ids: Sequence[int]) -> None:
        records = np.zeros(len(ids), dtype=_GOAL)
        records["id"] = ids
        params = _GOAL_POSITION_HEAD + records.tobytes()
        self._frame = bytearray(encode_instruction(BROADCAST_ID, Instruction.SYNC_WRITE, params))
        body = np.frombuffer(self._frame, _GOAL, len(ids), _FRAME_HEAD_BYTES)
        self.pulses = body["pulse"]
        self._end = len(self._frame) - _FRAME_CRC_BYTES
        self._body = memoryview(self._frame)[: self._end]

    def of(self, pulses: Floats) -> bytes:
        """Return the packet that sends these pulses, stuffed where it must be."""
        self.pulses[...] = pulses
        frame = self._frame
        if frame.find(STUFFED_PATTERN, len(HEADER)) >= 0:
            params = bytes(frame[_FRAME_HEAD_BYTES - len(_GOAL_POSITION_HEAD) : self._end])
            return encode_instruction(BROADCAST_ID, Instruction.SYNC_WRITE, params)
        crc = crc16(self._body)
        frame[self._end] = crc & 0xFF
        frame[self._end + 1] = crc >> 8
        return bytes(frame)
