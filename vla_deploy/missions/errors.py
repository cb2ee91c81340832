"""What can be wrong with a mission.

MissionError
├── MissionInvalid   give it anew: carries every fault of the document or the words
└── MissionsUnusable what is kept of missions cannot be read or written; says which file
"""

from collections.abc import Sequence


class MissionError(Exception):
    """Group the errors of missions."""


class MissionInvalid(MissionError):
    """Say everything that is wrong with a mission, one line each."""

    def __init__(self, faults: Sequence[str]) -> None:
        super().__init__("the mission was refused: " + "; ".join(faults))
        self.faults = tuple(faults)


class MissionsUnusable(MissionError):
    """Say why what is kept of missions cannot be used."""
