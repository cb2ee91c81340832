"""Load a server from a process of its own, which ends when it is told to, and says what came."""

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any


@contextmanager
def load_process(
    module: str, words: Sequence[str], told: dict[str, Any], failure: Exception
) -> Iterator[dict[str, Any]]:
    """Run `module` while it loads; yield `told`, to which it adds at the end.

    Raises:
        Exception: `failure`, where it does not say that it is ready.
    """
    with subprocess.Popen(
        [sys.executable, "-m", module, *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        if process.stdout.readline() != "ready\n":
            raise failure
        yield told
        process.stdin.close()
        told |= json.loads(process.stdout.readline())
