"""Hold the servos whose block is read by one request, and store their values in the state."""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from drivers.dynamixel.block import BlockRead, Columns
from drivers.dynamixel.codec import ALERT
from drivers.dynamixel.control_table import VOLTAGE_UNIT_V
from drivers.dynamixel.layout import CLIMATE, MOTION, STATUS, Block
from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.state import BusState
from drivers.dynamixel.sync_read import Entry

_ROWS: Final = MOTION + CLIMATE
"""What `BusState.readings` holds, row by row."""
_SIGN_OF_LIFE: Final = "voltage"
"""Never zero in a servo that answers, unless its indirect addresses are lost."""


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
        self._rows = [name for name in _ROWS if name in first.block.fields]
        self._status_names = [name for name in STATUS if name in first.block.fields]
        self._units = [[_units(spec)[name] for spec in specs] for name in self._rows]
        self._zeros = [spec.to_joint(0) for spec in specs]
        self._fills_rows = len(members) == len(reads)
        self._doubles = struct.Struct(f"{len(members) * len(self._rows)}d")
        self._memory = state.readings.data
        self._errors: tuple[int, ...] = ()
        self._status: list[tuple[int, ...]] = []

    def store(self) -> bool:
        """Store the reply that `read` has taken; False, and nothing is stored, if a map is lost."""
        columns, errors = self.read.columns, self.read.errors
        if 0 in columns.get(_SIGN_OF_LIFE, ()):
            return False
        self._store_readings(columns)
        if errors != self._errors:
            self._errors = errors
            self._store_errors(errors, self.members)
        if self._status_names:
            status = [columns[name] for name in self._status_names]
            if status != self._status:
                self._status = status
                self._store_status(status, self.members)
        self.answered = self.members
        self.blamed = ()
        return True

    def store_entries(self, entries: Mapping[int, Entry]) -> list[int]:
        """Store what some servos answered; return those that have lost their indirect map.

        A servo without a map answers zeros, its voltage too: none of it is taken.
        """
        places = [n for n, servo_id in enumerate(self.ids) if servo_id in entries]
        columns, errors = self.read.decode([entries[self.ids[n]] for n in places])
        signs = columns.get(_SIGN_OF_LIFE, (1,) * len(places))
        lost = [self.members[n] for n, sign in zip(places, signs, strict=True) if not sign]
        if lost:
            kept = {id_: entry for id_, entry in entries.items() if self._index(id_) not in lost}
            self.store_entries(kept)
            return lost
        self.answered = [self.members[n] for n in places]
        self._store_some_readings(columns, places)
        self._store_errors(errors, self.answered)
        self._store_status([columns.get(name, ()) for name in self._status_names], self.answered)
        self.forget_status()
        return []

    def forget_status(self) -> None:
        """Store the status of the next reply even if it is that of the last."""
        self._errors = ()
        self._status = []

    def _index(self, servo_id: int) -> int:
        return self.members[self.ids.index(servo_id)]

    def _store_readings(self, columns: Columns) -> None:
        position, *others = self._rows
        units, zeros = self._units[0], self._zeros
        values = [
            raw * unit + zero
            for raw, unit, zero in zip(columns[position], units, zeros, strict=True)
        ]
        for name, units in zip(others, self._units[1:], strict=True):
            values += [raw * unit for raw, unit in zip(columns[name], units, strict=True)]
        if self._fills_rows:
            self._doubles.pack_into(self._memory, 0, *values)
        else:
            count = len(self.members)
            for row in range(len(self._rows)):
                first = row * count
                self._state.readings[row, self.members] = values[first : first + count]

    def _store_some_readings(self, columns: Columns, places: Sequence[int]) -> None:
        readings = self._state.readings
        for row, (name, units) in enumerate(zip(self._rows, self._units, strict=True)):
            for place, raw in zip(places, columns.get(name, ()), strict=True):
                zero = 0.0 if row else self._zeros[place]
                readings[row, self.members[place]] = raw * units[place] + zero

    def _store_errors(self, errors: Sequence[int], members: Sequence[int]) -> None:
        self.error_news = True
        for index, error in zip(members, errors, strict=True):
            self._state.alert[index] = error >= ALERT

    def _store_status(self, status: Sequence[tuple[int, ...]], members: Sequence[int]) -> None:
        if not status or not members:
            return
        self.status_news = True
        torque, error, watchdog = status
        rows = list(members)
        self._state.torque_on[rows] = [value != 0 for value in torque]
        self._state.error[rows] = error
        self._state.watchdog[rows] = watchdog


def _units(spec: ServoSpec) -> dict[str, float]:
    """Return what one unit of each row of the readings is worth, on the joint side."""
    model = spec.model
    return {
        "position": spec.joint_per_pulse,
        "velocity": model.velocity_unit_rad_s * spec.sign * spec.travel_per_rad,
        "effort": model.effort_unit_ratio * spec.sign,
        "voltage": VOLTAGE_UNIT_V,
        "temperature": 1.0,
    }
