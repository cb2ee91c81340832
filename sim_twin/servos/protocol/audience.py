"""Find the servos that hear a packet: by id and secondary id, power, cable and baud rate."""

from collections.abc import Callable, Iterable, Mapping

from drivers.dynamixel.tables.control_table import BAUD_RATES, StatusReturnLevel
from drivers.dynamixel.wire.codec import MAX_SERVO_ID
from sim_twin.servos.firmware.firmware import Firmware
from sim_twin.servos.spec import FirmwareOptions


class BusAudience:
    """Keep the ids of a bus; `cut_off` and `mistuned` are faults of single servos, by row.

    `get` returns a register by row and name, `answers` whether a servo is powered and has booted.
    """

    def __init__(
        self,
        get: Callable[[int, str], int],
        count: int,
        answers: Callable[[int], bool],
        baud_rates: Mapping[int, int],
    ) -> None:
        self.cut_off: set[int] = set()
        self.mistuned: set[int] = set()
        self.host_baud: int | None = None
        self.deaf: set[int] = set()
        self.rows: dict[int, int] = {}
        self._get = get
        self._count = count
        self._answers = answers
        self._baud_rates = baud_rates
        self._by_id: dict[int, list[int]] = {}
        self.index()

    def index(self) -> set[int]:
        """Take over ids and baud rates from the tables; return the rows whose id is not unique."""
        self._by_id = {}
        for row in range(self._count):
            self._by_id.setdefault(self._get(row, "id"), []).append(row)
        self.rows = {servo_id: rows[0] for servo_id, rows in self._by_id.items()}
        self.tune()
        return {rows[0] for rows in self._by_id.values() if len(rows) > 1}

    def tune(self) -> None:
        """Work out anew who hears nothing."""
        detuned = {row for row in range(self._count) if not self._in_tune(row)}
        self.deaf = self.cut_off | self.mistuned | detuned

    def named(self, servo_id: int) -> list[int]:
        """Return every servo with this id; more than one where an id was given twice."""
        return self._by_id.get(servo_id, [])

    def everyone(self) -> list[int]:
        """Return all servos in the order of their ids."""
        return [row for servo_id in sorted(self._by_id) for row in self._by_id[servo_id]]

    def listens(self, row: int) -> bool:
        """Return whether a servo hears the host now."""
        return row not in self.deaf and self._answers(row)

    def _in_tune(self, row: int) -> bool:
        if self.host_baud is None:
            return True
        return self._baud_rates.get(self._get(row, "baud_rate")) == self.host_baud


class Audience(BusAudience):
    """Know the ids of a Dynamixel bus, secondary ones and those of repeated requests too."""

    def __init__(self, firmware: Firmware, options: FirmwareOptions) -> None:
        self._firmware = firmware
        self._options = options
        self._tables = tables = firmware.registers.tables
        self._by_secondary_id: dict[int, list[int]] = {}
        self._groups: dict[bytes, list[int]] = {}
        super().__init__(
            lambda row, name: tables[row].get(name), len(tables), firmware.answers, BAUD_RATES
        )

    def index(self) -> set[int]:
        """Take over ids and baud rates from the tables; return the rows whose id is not unique."""
        self._groups.clear()
        self._by_secondary_id = {}
        for row, table in enumerate(self._tables):
            secondary_id = table.get("secondary_id")
            if secondary_id <= MAX_SERVO_ID:
                self._by_secondary_id.setdefault(secondary_id, []).append(row)
        return super().index()

    def followers(self, servo_id: int) -> list[int]:
        """Return the servos that carry out packets to this id as their secondary one."""
        if servo_id in self._by_id or servo_id not in self._by_secondary_id:
            return []
        return self._by_secondary_id[servo_id]

    def group(self, ids: bytes) -> list[int]:
        """Return the rows of servos that a packet names again and again; none if one is odd."""
        if ids not in self._groups:
            rows = [row for servo_id in ids for row in self.named(servo_id)]
            self._groups = {ids: rows if len(set(rows)) == len(rows) == len(ids) else []}
        return self._groups[ids]

    def reader(self, servo_id: int) -> int | None:
        """Return the servo that answers a group read for this id."""
        row = self.rows.get(servo_id)
        if row is None or not self.listens(row):
            return None
        level = self._tables[row].get("status_return_level")
        return row if level >= StatusReturnLevel.READ else None

    def feed(self, rows: Iterable[int]) -> None:
        """Count a packet to these servos as communication for their watchdogs."""
        if self._options.watchdog_fed_by_any_packet:
            rows = range(len(self._tables))
        self._firmware.feed_watchdog(
            [row for row in rows if row not in self.deaf] if self.deaf else list(rows)
        )
