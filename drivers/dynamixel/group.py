"""Hold the servos whose block is read by one request, and store their values in the state."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from drivers.dynamixel.servo import ServoSpec
from drivers.dynamixel.supply_current import motor_current_ratio
from drivers.dynamixel.tables.control_table import VOLTAGE_UNIT_V
from drivers.dynamixel.tables.layout import CLIMATE, MOTION, STATUS, Block
from drivers.dynamixel.wire.block import BlockRead, decode
from drivers.dynamixel.wire.codec import ALERT
from drivers.dynamixel.wire.sync_read import Entry
from drivers.servo.state import BusState, Floats

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


@dataclass(slots=True)
class News:
    """Hold what may differ from the last cycle; its reader sets it back."""

    errors: bool = False
    status: bool = False


class Group:
    """Turn one request's raw values into the state's, on the joint side.

    `answered` and `blamed` hold the bus indices of the servos that gave values in the last cycle,
    and of those that are to blame for values that did not come.
    """

    def __init__(
        self,
        members: Sequence[int],
        reads: Sequence[ServoRead],
        state: BusState,
        news: News,
    ) -> None:
        self.members = tuple(members)
        specs = [reads[index].spec for index in members]
        first = reads[members[0]]
        self.ids = [spec.id for spec in specs]
        self.read = BlockRead(self.ids, first.block, fast=first.fast)
        self.answered: Sequence[int] = self.members
        self.blamed: Sequence[int] = ()
        self._news = news
        self._state = state
        self._fields = first.block.fields
        self._rows = [name for name in _ROWS if name in self._fields]
        self._units = np.array([[_units(spec)[name] for spec in specs] for name in self._rows])
        self._zeros = np.array([spec.to_joint(0) for spec in specs])
        self._fills_rows = len(members) == len(reads)
        rows = state.readings[: len(self._rows)]
        self._values = rows if self._fills_rows else np.empty_like(self._units)
        self._positions = self._values[0]
        self._at_supply = [
            place for place, spec in enumerate(specs) if spec.model.senses_supply_current
        ]
        self._no_load = np.array(
            [specs[n].model.no_load_speed_rad_s * specs[n].travel_per_rad for n in self._at_supply]
        )
        self._copies = [
            (self._values[start:end], self.read.columns(self._rows[start:end]))
            for start, end in _alike(first.block, self._rows)
        ]
        self._voltages = self.read.columns([_SIGN_OF_LIFE])[0] if self._has_map else None
        self._status_columns = [self.read.columns([name])[0] for name in self._status_names]
        self._errors = b""
        self._status: list[bytes] = []

    @property
    def _has_map(self) -> bool:
        return _SIGN_OF_LIFE in self._fields

    @property
    def _status_names(self) -> list[str]:
        return [name for name in STATUS if name in self._fields]

    def store(self) -> bool:
        """Store the reply that `read` has taken; False, and nothing is stored, if a map is lost."""
        if self._voltages is not None and 0 in self._voltages.tolist():
            return False
        values = self._values
        for rows, columns in self._copies:
            rows[...] = columns
        np.multiply(values, self._units, values)
        np.add(self._positions, self._zeros, self._positions)
        if self._at_supply:
            _find_motor_currents(values, self._at_supply, self._no_load)
        if not self._fills_rows:
            self._state.readings[: len(values), self.members] = values
        errors = self.read.errors
        if errors != self._errors:
            self._errors = errors
            self._store_errors(errors, self.members)
        self.answered = self.members
        self.blamed = ()
        if self._status_columns:
            self._note_status()
        return True

    def store_entries(self, entries: Mapping[int, Entry]) -> list[int]:
        """Store what some servos answered; return those that have lost their indirect map.

        A servo without a map answers zeros, its voltage too: none of it is taken.
        """
        places = [n for n, servo_id in enumerate(self.ids) if servo_id in entries]
        found = [entries[self.ids[n]] for n in places]
        lost = self._without_map(places, found)
        if lost:
            kept = {id_: entry for id_, entry in entries.items() if self._index(id_) not in lost}
            self.store_entries(kept)
            return lost
        self.answered = answered = [self.members[n] for n in places]
        for row, name in enumerate(self._rows):
            values = decode(self._fields[name], found) * self._units[row, places]
            self._state.readings[row, answered] = values if row else values + self._zeros[places]
        self._mend_efforts(places)
        self._store_errors([entry.error for entry in found], answered)
        self._store_status([decode(self._fields[name], found) for name in self._status_names])
        self.forget_status()
        return []

    def _mend_efforts(self, places: Sequence[int]) -> None:
        """Turn what some servos draw from the supply into their motors' currents."""
        chosen = [n for n, place in enumerate(self._at_supply) if place in places]
        if chosen:
            rows = [self.members[self._at_supply[n]] for n in chosen]
            _find_motor_currents(self._state.readings, rows, self._no_load[chosen])

    def forget_status(self) -> None:
        """Store the status of the next reply even if it is that of the last."""
        self._errors = b""
        self._status = []

    def _index(self, servo_id: int) -> int:
        return self.members[self.ids.index(servo_id)]

    def _without_map(self, places: Sequence[int], entries: Sequence[Entry]) -> list[int]:
        if not self._has_map:
            return []
        voltages = decode(self._fields[_SIGN_OF_LIFE], entries)
        return [self.members[n] for n, volts in zip(places, voltages, strict=True) if not volts]

    def _note_status(self) -> None:
        status = [column.tobytes() for column in self._status_columns]
        if status != self._status:
            self._status = status
            self._store_status([column.tolist() for column in self._status_columns])

    def _store_errors(self, errors: Sequence[int], members: Sequence[int]) -> None:
        self._news.errors = True
        for index, error in zip(members, errors, strict=True):
            self._state.alert[index] = error >= ALERT

    def _store_status(self, status: Sequence[Sequence[int]]) -> None:
        if not status or not self.answered:
            return
        self._news.status = True
        torque, error, watchdog = status
        rows = list(self.answered)
        self._state.torque_on[rows] = [value != 0 for value in torque]
        self._state.error[rows] = error
        self._state.watchdog[rows] = watchdog


def _find_motor_currents(readings: Floats, servos: Sequence[int], no_load: Floats) -> None:
    """Replace what some servos draw from the supply by their motors' currents, in place."""
    speed_ratio = readings[1, servos] / no_load
    readings[2, servos] = motor_current_ratio(readings[2, servos], speed_ratio)


def _alike(block: Block, names: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Cut names into runs of one type that are neighbours in the block; a run is copied at once."""
    fields = [block.fields[name] for name in names]
    cuts = [
        place
        for place, (one, other) in enumerate(pairwise(fields), start=1)
        if (other.size, other.signed) != (one.size, one.signed)
        or abs(other.start - one.start) != one.size
    ]
    yield from pairwise([0, *cuts, len(names)])


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
