"""Find the recording or the flight that a person means."""

from pathlib import Path

from vla_deploy.telemetry.folder import FlightFolder, folder_of
from vla_deploy.telemetry.recording.folder import RecordingFolder, recordings_dir_of


def find_recorded(base: Path, name: str) -> Path:
    """Return the file of that name, the recording of that number, or the newest of both kinds.

    Raises:
        FlightMissing: there is none.
    """
    folders = (RecordingFolder(recordings_dir_of(base)), FlightFolder(folder_of(base)))
    if Path(name).is_file():
        return Path(name)
    for folder in folders:
        if (name == "latest" and folder.files()) or name in {path.name for path in folder.files()}:
            return folder.find(name)
    return folders[0].find(name)
