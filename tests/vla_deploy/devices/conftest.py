"""Brokers that can be killed, and a lamp that is a client of one."""

import contextlib
import os
import shutil
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol

import paho.mqtt.client as mqtt
import pytest

from drivers.clock import NS_PER_S, MonotonicClock
from sim_twin.home.broker import EmulatedBroker
from vla_deploy.devices.mqtt_link import BrokerAddress

MOSQUITTO = shutil.which("mosquitto", path=f"{os.environ.get('PATH', '')}:/usr/sbin")
USER, PASSWORD = "robot", "correct-horse"
WITHIN_S = 10.0


class Broker(Protocol):
    """Be a broker that a test starts, kills and starts again at the same address."""

    address: BrokerAddress

    def start(self) -> None: ...

    def kill(self) -> None: ...


class Emulated:
    """The twin's broker."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "mqtt"
        self.address = BrokerAddress(str(self.path))
        self.broker: EmulatedBroker | None = None

    def start(self) -> None:
        self.broker = EmulatedBroker(self.path)

    def kill(self) -> None:
        if self.broker is not None:
            self.broker.close()
        self.broker = None


class Mosquitto:
    """Eclipse Mosquitto on a port of the loopback; with `login` it wants user and password."""

    def __init__(self, folder: Path, *, login: bool = False) -> None:
        assert MOSQUITTO is not None, "no mosquitto here; run scripts/system-packages"
        self.address = BrokerAddress("127.0.0.1", free_port())
        self.config = folder / "mosquitto.conf"
        lines = [f"listener {self.address.port} 127.0.0.1", "user root", "log_dest none"]
        if login:
            users = folder / "users"
            users.touch(mode=0o600)
            command = [f"{MOSQUITTO}_passwd".replace("sbin", "bin"), "-b", users, USER, PASSWORD]
            subprocess.run(command, check=True, capture_output=True)
            lines += ["allow_anonymous false", f"password_file {users}"]
        else:
            lines += ["allow_anonymous true"]
        self.config.write_text("\n".join(lines) + "\n")
        self.process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        self.process = subprocess.Popen([str(MOSQUITTO), "-c", str(self.config)])
        clock = MonotonicClock()
        end_ns = clock.now_ns() + round(WITHIN_S * NS_PER_S)
        while clock.now_ns() < end_ns:
            with contextlib.suppress(OSError):
                socket.create_connection((self.address.host, self.address.port)).close()
                return
            clock.sleep_until(clock.now_ns() + NS_PER_S // 100)
        raise TimeoutError("mosquitto does not listen")

    def kill(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait()
        self.process = None


def free_port() -> int:
    with socket.socket() as line:
        line.bind(("127.0.0.1", 0))
        return int(line.getsockname()[1])


class Client:
    """A client of a broker: it publishes what a test says, and answers commands as it says."""

    def __init__(self, address: BrokerAddress) -> None:
        self._client = mqtt.Client(
            mqtt.CallbackAPIVersion.VERSION2, transport="tcp" if address.port else "unix"
        )
        self._client.connect(address.host, address.port or 1883)
        self._client.loop_start()

    def say(self, topic: str, payload: str | bytes, *, retain: bool = True) -> None:
        self._client.publish(topic, payload, qos=1, retain=retain).wait_for_publish(WITHIN_S)

    def on_command(self, topic: str, answer: Callable[[str], Any]) -> None:
        """Call `answer` with each payload; this returns once the broker knows."""
        known = threading.Event()
        self._client.on_subscribe = lambda *_: known.set()
        self._client.on_message = lambda _c, _u, message: answer(message.payload.decode())
        self._client.subscribe(topic, qos=1)
        assert known.wait(WITHIN_S)

    def close(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()


@pytest.fixture(params=["emulated", "mosquitto"])
def broker(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Broker]:
    """A broker that runs."""
    kinds: dict[str, Callable[[Path], Broker]] = {"emulated": Emulated, "mosquitto": Mosquitto}
    made = kinds[request.param](tmp_path)
    made.start()
    yield made
    made.kill()


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[Mosquitto]:
    """A broker that wants user and password."""
    made = Mosquitto(tmp_path, login=True)
    made.start()
    yield made
    made.kill()


@pytest.fixture
def client(broker: Broker) -> Iterator[Client]:
    """A device's own connection to the broker."""
    made = Client(broker.address)
    yield made
    made.close()
