"""Group what can go wrong with remembering.

RecollectionError
├── MemoryUnusable   the file cannot be opened, read or written: mend the disk, or move it away
└── NoSuchEpisode    there is nothing of that number: list what there is
"""


class RecollectionError(Exception):
    """Base of everything that remembering raises."""


class MemoryUnusable(RecollectionError):
    """Say that the file cannot be used, and why."""


class NoSuchEpisode(RecollectionError):
    """Say that nothing of that number is remembered."""
