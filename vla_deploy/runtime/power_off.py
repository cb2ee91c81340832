"""Tell control that a person switches the robot off: only then does its end take power away."""

from pathlib import Path
from typing import Final

FILE_NAME: Final = "power_off"


def ask_power_off(run_dir: Path) -> None:
    """Let control take all power when it is ended next, however that comes.

    Raises:
        OSError: the run's directory cannot be written; control keeps what holds arms up.
    """
    (run_dir / FILE_NAME).touch(mode=0o600)


def power_off_asked(run_dir: Path) -> bool:
    """Return whether a person switches the robot off."""
    return (run_dir / FILE_NAME).exists()
