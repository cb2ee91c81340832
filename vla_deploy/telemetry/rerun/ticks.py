"""Plot control's ticks: how far apart they are, and what was sent."""

from collections.abc import Iterator
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc.memory.delta import DeltaReader
from vla_deploy.telemetry.channels import TICKS, tick_bytes
from vla_deploy.telemetry.judge import JUDGED_TYPES
from vla_deploy.telemetry.rerun.entity import Drawn, Entity
from vla_deploy.telemetry.rerun.plots import curve

_SENT: Final = ("sent", "sent_v_m_s", "sent_w_rad_s")


class Ticks:
    """Read the records of one writer, in their order."""

    def __init__(self) -> None:
        self._reader = DeltaReader(JUDGED_TYPES)
        self._before: tuple[int, int] | None = None

    def drawn(self, text: bytes) -> Drawn:
        """Return what a tick becomes; nothing where a record before it is missing.

        Raises:
            BadPayload: its record cannot be read, or this version does not know what it carries.
        """
        row = self._reader.row(tick_bytes(text))
        if row is None:
            return Drawn(entities=())
        return Drawn(entities=tuple(self._curves(row)), tick=row["tick"])

    def _curves(self, row: dict[str, Any]) -> Iterator[Entity]:
        tick, now_ns = row["tick"], row["now_ns"]
        before, self._before = self._before, (tick, now_ns)
        if before is not None and before[0] + 1 == tick:
            yield curve(f"{TICKS}/period_s", (now_ns - before[1]) / NS_PER_S)
        yield curve(f"{TICKS}/speed_ratio", row["verdict"].speed_ratio)
        for name in _SENT:
            if row[name] is not None:
                yield curve(f"{TICKS}/{name}", _numbers(row[name]))


def _numbers(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else value
