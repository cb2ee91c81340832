from collections.abc import Callable
from typing import Any

import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.model_servers.calls.exchange import Exchange
from vla_deploy.model_servers.server import ModelServer
from vla_deploy.model_servers.settings import ServerSettings
from vla_deploy.runtime.secret import Secret


class SteppedClock:
    """Count the time that waits add up to; nobody really waits."""

    def __init__(self) -> None:
        self.time_ns = NS_PER_S
        self.waits_s: list[float] = []

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.waits_s.append((deadline_ns - self.time_ns) / NS_PER_S)
        self.time_ns = max(self.time_ns, deadline_ns)


@pytest.fixture
def clock() -> SteppedClock:
    return SteppedClock()


@pytest.fixture
def settings() -> Callable[..., ServerSettings]:
    """Declare a local server with short times, some values replaced."""

    def declare(url: str = "http://127.0.0.1:9", **changes: Any) -> ServerSettings:
        declared = {
            "api": "openai_compatible",
            "url": url,
            "model": "tiny",
            "location": "local",
            "connect_timeout_s": 10.0,
            "read_timeout_s": 10.0,
            "total_timeout_s": 20.0,
        }
        return ServerSettings.model_validate(declared | changes)

    return declare


@pytest.fixture
def open_server(settings: Callable[..., ServerSettings]) -> Callable[..., ModelServer]:
    """Open a server of those settings; only its clock, its luck and its resolver may be played."""

    def open_server(
        url: str,
        clock: Any = None,
        key: str = "",
        draw: Callable[[], float] = lambda: 0.5,
        resolve: Any = None,
        **changes: Any,
    ) -> ModelServer:
        declared = settings(url, **changes)
        exchange = Exchange(declared, resolve) if resolve else Exchange(declared)
        secret = Secret(key) if key else None
        return ModelServer("bench", declared, secret, exchange, clock or MonotonicClock(), draw)

    return open_server
