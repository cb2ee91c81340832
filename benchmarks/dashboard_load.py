"""Load a dashboard as an attack does: slow connections, costly reads, TLS handshakes.

`python -m benchmarks.dashboard_load HOST PORT RUNTIME_BASE` prints "ready" once all of it goes on,
and how much came through as JSON when its input ends. Handshakes go on also where the dashboard
serves without TLS: it has to refuse each of them.
"""

import contextlib
import json
import os
import socket
import ssl
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from http.client import HTTPConnection, HTTPException
from itertools import cycle, islice
from pathlib import Path
from typing import Final, NoReturn

from vla_deploy.client.access.local_token import local_headers

SLOW: Final = 200
READERS: Final = 30
HANDSHAKES: Final = 40
READS: Final = ("camera.jpg", "map", "logs?limit=1000", "map.png", "robot/model")
_HEAD: Final = b"GET /api/v1/state HTTP/1.1\r\nX-Slow: "
_NICE: Final = 15
_REST_S: Final = 0.01
_DRIP_S: Final = 0.5
_PATIENCE_S: Final = 10.0


class DashboardLoad:
    """Hold what one dashboard is loaded with, each in a thread of its own."""

    def __init__(self, address: tuple[str, int], headers: Mapping[str, str]) -> None:
        self.counts: Counter[str] = Counter()
        self._address = address
        self._headers = headers

    def start(self) -> None:
        """Begin; nothing ends but with the process."""
        acts: list[Callable[[], NoReturn]] = [self._hold_slow]
        acts += [self._read_for_ever] * READERS + [self._shake_hands] * HANDSHAKES
        for act in acts:
            threading.Thread(target=act, daemon=True).start()

    def _hold_slow(self) -> NoReturn:
        held: list[socket.socket] = []
        while True:
            for connection in [*held]:
                try:
                    connection.sendall(b"a")
                except OSError:
                    held.remove(connection)
                    connection.close()
            while len(held) < SLOW:
                try:
                    held.append(socket.create_connection(self._address, timeout=_PATIENCE_S))
                    held[-1].sendall(_HEAD)
                except OSError:
                    break
                self.counts["slow"] += 1
            time.sleep(_DRIP_S)

    def _read_for_ever(self) -> NoReturn:
        paths = islice(cycle(READS), threading.get_ident() % len(READS), None)
        while True:
            connection = HTTPConnection(*self._address, timeout=_PATIENCE_S)
            with contextlib.suppress(OSError, HTTPException), contextlib.closing(connection):
                while True:
                    connection.request("GET", f"/api/v1/{next(paths)}", headers=self._headers)
                    connection.getresponse().read()
                    self.counts["reads"] += 1
            time.sleep(_REST_S)

    def _shake_hands(self) -> NoReturn:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        while True:
            with (
                contextlib.suppress(OSError),
                socket.create_connection(self._address, timeout=_PATIENCE_S) as connection,
                context.wrap_socket(connection),
            ):
                pass
            self.counts["handshakes"] += 1
            time.sleep(_REST_S)


def main(argv: Sequence[str]) -> int:
    """Load a dashboard until the input ends."""
    host, port, base = argv
    os.nice(_NICE)
    load = DashboardLoad((host, int(port)), local_headers(Path(base)))
    load.start()
    print("ready", flush=True)
    sys.stdin.read()
    print(json.dumps(load.counts), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
