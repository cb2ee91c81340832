"""Hold the servos whose block is read by one request, and store their values in the state."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.dynamixel.block import BlockRead, raw_unit
from drivers.dynamixel.codec import ALERT
from drivers.dynamixel.control_table import VOLTAGE_UNIT_V
from drivers.dynamixel.layout import Block
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.state import BusState
from drivers.dynamixel.sync_read import Entry

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoRead:
    """Say how a servo's block is read; servos of one `key` share a request."""

    spec: ServoSpec
    block: Block
    fast: bool

    @property
    def key(self) -> tuple[int, int, bool]:
        """Return what must be equal for servos to be read together."""
        return self.block.address, self.block.size, self.fast


class Group:
    """Turn one request's raw values into the state's, on the joint side.

    `answered` and `blamed` hold the bus indices of the servos that gave values in the last cycle,
    and of those that are to blame for values that did not come.
    """

    def __init__(self, members: Sequence[int], reads: Sequence[ServoRead], state: BusState) -> None:
        self.members = tuple(members)
        specs = [reads[index].spec for index in members]
        first = reads[members[0]]
        self.ids = [spec.id for spec in specs]
        self.read = BlockRead(self.ids, first.block, fast=first.fast)
        self.answered: Sequence[int] = self.members
        self.blamed: Sequence[int] = ()
        self.error_news = False
        self.status_news = False
        self._state = state
        self._rows: Indices = np.array(members, dtype=np.intp)
        self._units = np.array([_units(spec, first.block) for spec in specs]).T
        self._at_pulse_zero = np.array([spec.to_joint(0) for spec in specs])
        together = members[-1] - members[0] + 1 == len(members)
        target = state.readings[: len(self._units), members[0] : members[-1] + 1]
        self._scattered = not together
        self._values: Floats = target if together else np.zeros(self._units.shape)
        self._positions = self._values[0]
        self._errors = b""
        self._status: tuple[bytes, ...] = ()

    def store(self) -> None:
        """Store the reply that `read` has taken: all servos have answered as usual."""
        np.multiply(self.read.raw, self._units, self._values)
        np.add(self._positions, self._at_pulse_zero, self._positions)
        if self._scattered:
            self._state.readings[: len(self._units)][:, self._rows] = self._values
        if self.read.errors != self._errors:
            self._errors = self.read.errors
            self._store_errors(self._errors, self._rows)
        if self.read.status != self._status:
            self._status = self.read.status
            self._store_status(self._status, self._rows)
        self.answered = self.members
        self.blamed = ()

    def store_entries(self, entries: Mapping[int, Entry]) -> list[int]:
        """Store what some servos answered; return those that have lost their indirect map.

        A servo without a map answers zeros, its voltage too: none of it is taken.
        """
        columns = [n for n, servo_id in enumerate(self.ids) if servo_id in entries]
        lost = [n for n in columns if self._is_unmapped(entries[self.ids[n]])]
        kept = [n for n in columns if n not in lost]
        raw, errors, status = self.read.decode(entries, [self.ids[n] for n in kept])
        values = raw * self._units[:, kept]
        values[0] += self._at_pulse_zero[kept]
        rows = self._rows[kept]
        self._state.readings[: len(values)][:, rows] = values
        self._store_errors(errors, rows)
        self._store_status(status, rows)
        self.forget_status()
        self.answered = [self.members[n] for n in kept]
        return [self.members[n] for n in lost]

    def forget_status(self) -> None:
        """Store the status of the next reply even if it is that of the last."""
        self._errors = b""
        self._status = ()

    def _is_unmapped(self, entry: Entry) -> bool:
        voltage = self.read.block.fields.get("voltage")
        if voltage is None:
            return False
        return not any(entry.data[voltage.start : voltage.start + voltage.size])

    def _store_errors(self, errors: bytes, rows: Indices) -> None:
        self.error_news = True
        self._state.alert[rows] = np.frombuffer(errors, np.uint8) >= ALERT

    def _store_status(self, status: tuple[bytes, ...], rows: Indices) -> None:
        if not status:
            return
        self.status_news = True
        torque, error, watchdog = status
        self._state.torque_on[rows] = np.frombuffer(torque, np.uint8) != 0
        self._state.error[rows] = np.frombuffer(error, np.uint8)
        self._state.watchdog[rows] = np.frombuffer(watchdog, np.int8)


def _units(spec: ServoSpec, block: Block) -> list[float]:
    """Return what one unit of each row of the block is worth, on the joint side."""
    model = spec.model
    units = {
        "position": spec.joint_per_pulse,
        "velocity": model.velocity_unit_rad_s * spec.sign * spec.travel_per_rad,
        "effort": model.effort_unit_ratio * spec.sign,
        "voltage": VOLTAGE_UNIT_V,
        "temperature": 1.0,
    }
    return [
        unit * raw_unit(block.fields[name]) for name, unit in units.items() if name in block.fields
    ]
