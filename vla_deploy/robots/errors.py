"""Say what is wrong with a robot file.

RobotFileError    the robot file, or a file it names, cannot be used: fix every fault it lists
"""

from pathlib import Path

from vla_deploy.runtime.table_schema import TableFault


class RobotFileError(ValueError):
    """Report every fault of one robot file at once."""

    def __init__(self, file: Path, faults: tuple[TableFault, ...]) -> None:
        self.file = file
        self.faults = faults
        if len(faults) == 1:
            super().__init__(f"{file}: {faults[0]}")
            return
        lines = "\n".join(f"  {fault}" for fault in faults)
        super().__init__(f"{file}: {len(faults)} faults\n{lines}")
