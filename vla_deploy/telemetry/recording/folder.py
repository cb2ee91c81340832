"""Keep recordings in a bounded folder; what a killed recorder was writing is made whole."""

import logging
from pathlib import Path

from vla_deploy.runtime.state_dir import library_dir_of
from vla_deploy.telemetry.folder import NumberedFolder
from vla_deploy.telemetry.recording.recovery import recover

_log = logging.getLogger(__name__)


def recordings_dir_of(base: Path) -> Path:
    """Return where the runs of a runtime directory leave their recordings."""
    return library_dir_of(base) / "recordings"


class RecordingFolder(NumberedFolder):
    """Keep the recordings of one folder."""

    noun = "recording"
    verb = "record"

    def sweep(self) -> None:
        """Recover what a killed recorder was writing; where nothing is whole, delete it."""
        for half in self.path.glob(".*.mcap.whole"):
            half.unlink(missing_ok=True)
        for part in self.unfinished_files():
            whole = part.with_name(part.name.replace(".mcap.part", ".mcap.whole"))
            try:
                messages = recover(part, whole)
                if messages:
                    whole.rename(part.with_name(_final_name(part)))
                part.unlink()
                _log.info("recovered %d messages of %s", messages, _final_name(part))
            except OSError as error:
                _log.warning("%s is not recovered: %s; it stays", part, error.strerror)
            finally:
                whole.unlink(missing_ok=True)

    def unfinished_files(self) -> list[Path]:
        """Return the files that are being written, or that a killed recorder was writing."""
        return sorted(self.path.glob(".*.mcap.part"))


def _final_name(part: Path) -> str:
    return part.name.removeprefix(".").removesuffix(".part")
