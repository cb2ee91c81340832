"""Write goals for all servos, converted from the joint side and clamped to the servo's range."""

from collections.abc import Collection, Mapping, Sequence
from math import isfinite
from typing import Final

import numpy as np
from numpy.typing import NDArray

from drivers.errors import DriverError, LinkLost
from drivers.feetech.codec import (
    FEETECH_BROADCAST_ID,
    FEETECH_HEADER,
    FeetechInstruction,
    check_sum,
    encode_packet,
)
from drivers.feetech.link import FeetechLink
from drivers.feetech.servo import FeetechServo
from drivers.feetech.settings import FeetechSetup
from drivers.feetech.table import LOAD_FULL
from drivers.servo.members import require_goals
from drivers.servo.patience import ReplyPatience

_FIRST_RECORD: Final = len(FEETECH_HEADER) + 5  # id, length, instruction, address, size
_RECORD_BYTES: Final = 3
_SIGN: Final = 0x8000

Floats = NDArray[np.float64]


class FeetechGoals:
    """Write goal positions in one sync write, and torque limits when they change."""

    def __init__(
        self,
        link: FeetechLink,
        servos: Sequence[FeetechServo],
        setups: Sequence[FeetechSetup],
        *,
        margin_s: float,
    ) -> None:
        self._link = link
        self._servos = {servo.id: servo for servo in servos}
        self._joints = [servo.joint for servo in servos]
        self._patience = ReplyPatience(margin_s=margin_s, attempts=2)
        self._per_pulse = np.array([servo.joint_per_pulse for servo in servos])
        self._at_zero = np.array([servo.to_joint(0) for servo in servos])
        self._per_joint = [
            (zero, 1.0 / per_pulse, setup.minimum_pulse, setup.maximum_pulse)
            for zero, per_pulse, setup in zip(
                self._at_zero.tolist(), self._per_pulse.tolist(), setups, strict=True
            )
        ]
        is_big = servos[0].datasheet.byte_order == "big"
        self._low_at, self._high_at = (2, 1) if is_big else (1, 2)
        self._pulses = [0] * len(servos)
        self._limits = {
            servo.id: setup.torque_limit for servo, setup in zip(servos, setups, strict=True)
        }
        self._sent_limits: dict[int, int] = {}
        register = servos[0].datasheet.registers["goal_position"]
        params = bytes((register.address, register.size))
        for servo in servos:
            params += bytes((servo.id, 0, 0))
        frame = encode_packet(FEETECH_BROADCAST_ID, FeetechInstruction.SYNC_WRITE, params)
        self._frame = bytearray(frame)

    @property
    def sent(self) -> Floats:
        """Return the goals sent last, on the joint side."""
        joint: Floats = np.array(self._pulses) * self._per_pulse + self._at_zero
        return joint

    def write(self, position_rad: Floats, without: Collection[int] = ()) -> None:
        """Send a goal to every servo but those in the rows `without`, which keep what they have.

        Raises:
            ValueError: a goal is not finite, or there is not one per servo.
            LinkLost: the adapter is gone.
        """
        goals = position_rad.tolist()
        if len(goals) != len(self._per_joint) or not isfinite(sum(goals)):
            require_goals(self._joints, position_rad)
        frame, place = self._frame, _FIRST_RECORD
        for row, (goal, (zero, pulses_per, least, most)) in enumerate(
            zip(goals, self._per_joint, strict=True)
        ):
            pulse = round((goal - zero) * pulses_per)
            pulse = least if pulse < least else min(pulse, most)
            self._pulses[row] = pulse
            word = pulse if pulse >= 0 else _SIGN - pulse
            frame[place + self._low_at] = word & 0xFF
            frame[place + self._high_at] = word >> 8
            place += _RECORD_BYTES
        if without:
            self._send_to_others(without)
            return
        frame[-1] = check_sum(frame[len(FEETECH_HEADER) : -1])
        self._link.send(bytes(frame))

    def _send_to_others(self, without: Collection[int]) -> None:
        rows = [row for row in range(len(self._joints)) if row not in without]
        if not rows:
            return
        starts = [_FIRST_RECORD + _RECORD_BYTES * row for row in rows]
        head = self._frame[len(FEETECH_HEADER) + 3 : _FIRST_RECORD]  # address and size
        records = (self._frame[start : start + _RECORD_BYTES] for start in starts)
        params = bytes(head) + b"".join(records)
        self._link.send(encode_packet(FEETECH_BROADCAST_ID, FeetechInstruction.SYNC_WRITE, params))

    def limit_effort(self, ratios: Mapping[int, float]) -> dict[int, DriverError]:
        """Limit the duty of servos by id, where it changed; return those that did not take it.

        Raises:
            ValueError: a ratio is not within 0..1, or an id is unknown.
            LinkLost: the adapter is gone.
        """
        failures: dict[int, DriverError] = {}
        for servo_id, ratio in ratios.items():
            value = self._limit_value(servo_id, ratio)
            if self._sent_limits.get(servo_id) == value:
                continue
            servo = self._servos[servo_id]
            if "torque_limit" not in servo.datasheet.registers:
                if ratio < 1.0:
                    failures[servo_id] = DriverError(f"{servo}: this model has no torque limit")
                continue
            try:
                self._link.write(servo, "torque_limit", value, self._patience)
                self._sent_limits[servo_id] = value
            except LinkLost:
                raise
            except DriverError as error:
                failures[servo_id] = error
        return failures

    def forget_limit(self, servo_id: int) -> None:
        """Write the torque limit anew the next time: the servo has lost it."""
        self._sent_limits.pop(servo_id, None)

    def _limit_value(self, servo_id: int, ratio: float) -> int:
        if servo_id not in self._servos:
            raise ValueError(f"no servo {servo_id} on this bus; it has {sorted(self._servos)}")
        if not 0.0 <= ratio <= 1.0:
            raise ValueError(
                f"{self._servos[servo_id]}: effort ratio must be within 0..1, got {ratio}"
            )
        return min(round(ratio * LOAD_FULL), self._limits[servo_id])
