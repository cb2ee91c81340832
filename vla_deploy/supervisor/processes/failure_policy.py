"""Do what the table says becomes of the robot when a process is given up."""

import logging
from collections.abc import Mapping

from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.processes.lifecycle import ProcessRecord, ProcessState
from vla_deploy.supervisor.table import GivingUp, ProcessSpec

_log = logging.getLogger(__name__)


class Consequences:
    """Hold what follows from the processes that were given up.

    `end` is why the run must end, `refusal` why no command is taken; "" where nothing is.
    """

    def __init__(self, table: tuple[ProcessSpec, ...]) -> None:
        self.end = ""
        self.refusal = ""
        self._table = table
        self._known: set[str] = set()

    def take(self, records: Mapping[str, ProcessRecord], space: SharedSpace) -> None:
        """Act on every process that is newly given up."""
        for spec in self._table:
            record = records[spec.name]
            if record.state is ProcessState.GIVEN_UP and spec.name not in self._known:
                self._known.add(spec.name)
                self._take(spec, f"{spec.name} was given up: {record.reason}", space)

    def _take(self, spec: ProcessSpec, why: str, space: SharedSpace) -> None:
        _log.error("%s; %s", why, spec.giving_up.value)
        if spec.giving_up is GivingUp.END_RUN:
            self.end = f"{why}; see: vla-deploy crashes list"
        elif spec.giving_up is GivingUp.NO_COMMANDS:
            self.refusal = f"{why}; see: vla-deploy crashes list, then start the run anew"
            # The planner may be the one that is gone: the executor is told without it.
            space.ring_writer("plan").publish({"command_id": "supervisor", "cancel": True})
