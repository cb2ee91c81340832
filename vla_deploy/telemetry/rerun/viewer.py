"""Open Rerun's viewer on this computer, listening on loopback only."""

import os
import socket
import subprocess
import sys
import tempfile
from typing import IO, Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.telemetry.errors import ExtraMissing

PORT: Final = 9876
_HOST: Final = "127.0.0.1"
_WITHIN_NS: Final = 20 * NS_PER_S
_STEADY_NS: Final = NS_PER_S  # it listens before it has a window, and may find no screen
_POLL_NS: Final = NS_PER_S // 10
_MAX_TEXT: Final = 300


def url_of(port: int) -> str:
    """Return the address of a viewer on this computer."""
    return f"rerun+http://{_HOST}:{port}/proxy"


def open_viewer(port: int, clock: Clock) -> None:
    """Start a viewer that outlives this process and wait for it, unless one is open already.

    Raises:
        ExtraMissing: it does not come up, as without a screen.
    """
    if _listens(port):
        return
    with tempfile.TemporaryFile() as errors:
        viewer = _start(port, errors)
        end_ns, steady_ns = clock.now_ns() + _WITHIN_NS, 0
        while steady_ns < _STEADY_NS:
            if viewer.poll() is not None or clock.now_ns() >= end_ns:
                raise ExtraMissing(
                    f"rerun: no viewer comes up on this computer: {_last_words(errors)}; write a "
                    "file with --save out.rrd, and open it where there is a screen"
                )
            clock.sleep_until(clock.now_ns() + _POLL_NS)
            steady_ns = steady_ns + _POLL_NS if _listens(port) else 0


def _start(port: int, errors: IO[bytes]) -> subprocess.Popen[bytes]:
    """Start the viewer on loopback; by default it listens on every network."""
    return subprocess.Popen(
        [sys.executable, "-m", "rerun", "--bind", _HOST, "--port", str(port)],
        # It sends usage reports to its maker unless CI is set.
        env={**os.environ, "CI": "1", "RUST_LOG": "error", "NO_COLOR": "1"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=errors,
        start_new_session=True,
    )


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        probe.settimeout(1.0)
        return probe.connect_ex((_HOST, port)) == 0


def _last_words(errors: IO[bytes]) -> str:
    errors.seek(0)
    words = errors.read().decode(errors="replace").split()
    return " ".join(words)[-_MAX_TEXT:] or "it says nothing"
