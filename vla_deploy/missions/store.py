"""Keep missions over restarts of the planner, in one file that is always whole."""

import json
import os
from pathlib import Path
from typing import Final

from pydantic import ValidationError

from vla_deploy.missions.errors import MissionsUnusable
from vla_deploy.missions.progress import MissionRun

FILE_NAME: Final = "missions.json"
MOST_KEPT: Final = 20


def newest(runs: list[MissionRun]) -> list[MissionRun]:
    """Return the missions to keep: the newest, and all that have not ended."""
    ended = [one for one in runs if one.state.is_final and not one.repeats()]
    gone = {one.mission_id for one in ended[: max(0, len(runs) - MOST_KEPT)]}
    return [one for one in runs if one.mission_id not in gone]


class MissionStore:
    """Read and write the missions of a robot; without a file nothing is kept."""

    def __init__(self, file: Path | None = None) -> None:
        self.file = file

    def load(self) -> list[MissionRun]:
        """Return what was kept, the oldest first.

        Raises:
            MissionsUnusable: the file cannot be read, or holds something else.
        """
        if self.file is None or not self.file.exists():
            return []
        try:
            told = json.loads(self.file.read_text(encoding="utf-8"))
            return [MissionRun.model_validate(one) for one in told]
        except (OSError, ValueError, TypeError, RecursionError, ValidationError) as error:
            kept = self.file.with_suffix(".unreadable")
            raise MissionsUnusable(
                f"{self.file} does not hold missions ({str(error)[:120]}); it stays as {kept.name}"
            ) from error

    def keep_unreadable(self) -> None:
        """Move a file that cannot be read out of the way, so that it is neither used nor lost."""
        if self.file is not None and self.file.exists():
            self.file.replace(self.file.with_suffix(".unreadable"))

    def save(self, runs: list[MissionRun]) -> None:
        """Write missions.

        Raises:
            MissionsUnusable: the file cannot be written.
        """
        if self.file is None:
            return
        text = json.dumps([one.model_dump(mode="json") for one in runs])
        part = self.file.with_suffix(".part")
        try:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            with part.open("w", encoding="utf-8") as stream:
                stream.write(text)
                stream.flush()
                os.fsync(stream.fileno())
            part.replace(self.file)
        except OSError as error:
            raise MissionsUnusable(f"cannot keep missions in {self.file}: {error}") from error
