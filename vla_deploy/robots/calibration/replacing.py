"""Replace a file of a robot's folder in one act, and keep the one before."""

import os
import shutil
from pathlib import Path

from vla_deploy.robots.errors import RobotFileError
from vla_deploy.runtime.table_schema import TableFault


def replace_text(
    file: Path, text: str, *, expected: str = "a file that can be written; choose one with --output"
) -> None:
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
        fault = TableFault(key="(file)", got=error.strerror or str(error), expected=expected)
        raise RobotFileError(file, (fault,)) from error
