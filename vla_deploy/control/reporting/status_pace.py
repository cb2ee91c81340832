"""Say when `control_status` is due: a change soon, and every so often what has not changed."""

from typing import Final

LEAST_GAP_TICKS: Final = 5


class StatusPace:
    """Remember what was told last, and in which tick."""

    def __init__(self) -> None:
        self._told: object = None
        self._told_tick: int | None = None

    def is_due(self, tick: int, matters: object, every_ticks: int) -> bool:
        """Return whether to publish in this tick; `matters` is what nobody may learn late."""
        if self._told_tick is not None:
            gap_ticks = tick - self._told_tick
            is_news = matters != self._told and gap_ticks >= LEAST_GAP_TICKS
            if gap_ticks < every_ticks and not is_news:
                return False
        self._told, self._told_tick = matters, tick
        return True
