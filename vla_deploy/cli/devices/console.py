"""Guide the person at the terminal through work on the robot."""

import os
import select
import sys
from collections.abc import Callable
from typing import Final

from vla_deploy.cli.errors import CommandFailed

_POLL_S: Final = 0.02


class Console:
    """Guide the person at the terminal, or a script at the other end of a pipe."""

    def __init__(self, *, quiet: bool) -> None:
        self._stream = sys.stderr if quiet else sys.stdout

    def tell(self, text: str) -> None:
        """Print a message."""
        print(text, file=self._stream, flush=True)

    def wait(self, text: str, meanwhile: Callable[[], None]) -> None:
        """Print what to do and wait for Enter.

        Raises:
            CommandFailed: the input ended.
        """
        print(f"{text}, then press Enter", file=self._stream, flush=True)
        while not select.select([sys.stdin], [], [], _POLL_S)[0]:
            meanwhile()
        while (byte := os.read(sys.stdin.fileno(), 1)) != b"\n":
            if not byte:
                raise CommandFailed("the input ended; what was written before stays")
