"""End a campaign in order on SIGTERM: what it has started ends with it, and its folders go."""

import signal
from types import FrameType
from typing import Final

EXIT_TERMINATED: Final = 128 + signal.SIGTERM  # as a shell tells the end by SIGTERM


def end_on_sigterm() -> None:
    """Let SIGTERM raise `SystemExit` in the main thread, so that every `finally` runs.

    `timeout` sends it twice, to the process and to its group: the second one cuts nothing short.
    """
    signal.signal(signal.SIGTERM, _end)


def _end(_number: int, _frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, _go_on)  # no SIG_IGN, which children would inherit
    raise SystemExit(EXIT_TERMINATED)


def _go_on(_number: int, _frame: FrameType | None) -> None:
    """Do nothing: the end is under way."""
