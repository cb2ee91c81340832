"""Tell the alarms to pages as a live topic."""

from collections.abc import Sequence
from typing import Final

from vla_deploy.dashboard.alarms.desk import AlarmDesk
from vla_deploy.dashboard.live.message import Message, Moment, json_message

TOPIC: Final = "alarms"


class AlarmFeed:
    """Tell all alarms when any has changed."""

    topic = TOPIC
    period_s = 0.5

    def __init__(self, desk: AlarmDesk) -> None:
        self._desk = desk
        self._told = -1

    def begin(self) -> None:
        """Tell what there is."""
        self._told = -1

    def look(self, now: Moment) -> Sequence[Message]:
        """Return the alarms, if any has changed."""
        if self._desk.revision == self._told:
            return ()
        self._told = self._desk.revision
        return (json_message(self.topic, now.run_ns, now, self._desk.document()),)
