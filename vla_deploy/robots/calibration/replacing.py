"""Replace a calibration file in one act, and keep the one before."""

import os
import shutil
from pathlib import Path

from vla_deploy.robots.errors import RobotFileError
from vla_deploy.robots.schema import RobotFileFault


def replace_text(file: Path, text: str) -> None:
    """Write a file under another name, then put it in place; `<file>.bak` is the one before.

    Raises:
        RobotFileError: it cannot be written; the old file stays.
    """
    fresh = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        with fresh.open("w", encoding="utf-8") as stream:
            stream.write(text)
            stream.flush()
            os.fsync(stream.fileno())
        if file.exists():
            shutil.copy2(file, file.with_name(file.name + ".bak"))
        fresh.replace(file)
    except OSError as error:
        fresh.unlink(missing_ok=True)
        expected = "a file that can be written; choose one with --output"
        fault = RobotFileFault(key="(file)", got=error.strerror or str(error), expected=expected)
        raise RobotFileError(file, (fault,)) from error
