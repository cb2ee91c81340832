"""Give a process room for the files that it opens, and keep those it makes from other users."""

import os
import resource
from pathlib import Path
from typing import Final

MOST_OPEN: Final = 4096
"""The dashboard holds 450 (a topic takes two) and 580 connections; systemd's default is 1024."""
_NOT_FOR_OTHERS: Final = 0o027
_OWN_FILES: Final = Path("/proc/self/fd")


def raise_open_files() -> int:
    """Raise the limit of open files as far as the kernel permits, to `MOST_OPEN`; return it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = MOST_OPEN if hard == resource.RLIM_INFINITY else min(hard, MOST_OPEN)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
    return resource.getrlimit(resource.RLIMIT_NOFILE)[0]


def keep_files_private() -> None:
    """Take every right of others, and writing of the group, from files that are made from now on.

    Logs hold what was said in the room; a stricter mask of the user stays.
    """
    os.umask(os.umask(_NOT_FOR_OTHERS) | _NOT_FOR_OTHERS)


def open_files_left() -> int:
    """Return how many more files this process may open now."""
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    held = sum(1 for _ in _OWN_FILES.iterdir())
    return MOST_OPEN if soft == resource.RLIM_INFINITY else max(0, soft - held)
