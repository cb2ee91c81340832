"""Say what is wrong with the files that describe a robot and its home.

RobotError
├── RobotFileError    the robot file, or a file it names, cannot be used: fix every fault it lists
├── MapInvalid        the map of its home cannot be used, or not be written: mend its files
└── PartMissing       the robot file has no such part: it cannot do what needs it
"""

from pathlib import Path

from vla_deploy.runtime.table_schema import TableFault


class RobotError(Exception):
    """Base of what a person has to mend in a robot's files."""


class RobotFileError(RobotError, ValueError):
    """Report every fault of one robot file at once."""

    def __init__(self, file: Path, faults: tuple[TableFault, ...]) -> None:
        self.file = file
        self.faults = faults
        if len(faults) == 1:
            super().__init__(f"{file}: {faults[0]}")
            return
        lines = "\n".join(f"  {fault}" for fault in faults)
        super().__init__(f"{file}: {len(faults)} faults\n{lines}")


class MapInvalid(RobotError):
    """Say what is wrong with a map file."""


class PartMissing(RobotError):
    """Say which part a robot does not have, and so what it cannot do."""
