"""Keep the ledger in a file, so that it outlives the dashboard; a spoilt one is begun anew."""

import json
import logging
from pathlib import Path
from typing import Final

from vla_deploy.dashboard.alarms.alarm import alarm_of
from vla_deploy.dashboard.alarms.ledger import Ledger

_MODE: Final = 0o600
_log = logging.getLogger(__name__)


class AlarmFile:
    """Read and write one ledger together with the run that it is of."""

    def __init__(self, path: Path) -> None:
        self.refused = 0
        """How many writes the disk has refused."""
        self._path = path

    def read(self) -> tuple[str, Ledger]:
        """Return the run and its ledger; an empty one where there is none that can be read."""
        try:
            document = json.loads(self._path.read_text(encoding="utf-8"))
            alarms = tuple(alarm_of(one) for one in document["alarms"])
            return str(document["run"]), Ledger(alarms=alarms, next_number=int(document["next"]))
        except FileNotFoundError:
            return "", Ledger()
        except (OSError, ValueError, TypeError, KeyError) as error:
            _log.warning("%s: the alarms of before are lost: %s", self._path, error)
            return "", Ledger()

    def write(self, run: str, ledger: Ledger) -> None:
        """Replace the file; what the disk refuses is counted, and told once."""
        alarms = [alarm.document() for alarm in ledger.alarms]
        text = json.dumps({"run": run, "next": ledger.next_number, "alarms": alarms})
        fresh = self._path.with_suffix(".new")
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            fresh.write_text(text, encoding="utf-8")
            fresh.chmod(_MODE)
            fresh.replace(self._path)
        except OSError as error:
            if not self.refused:
                _log.warning("%s: alarms will not outlive the dashboard: %s", self._path, error)
            self.refused += 1
