"""Hold that the door opens whatever is wrong around it, and that it tells what that is."""

import shutil
import socket
import ssl
import subprocess
import sys
from contextlib import closing
from dataclasses import replace

import pytest

from vla_deploy.runtime.net import DashboardSettings, DashboardSettingsInvalid
from vla_deploy.stop_door.node import StopDoorNode

PRESS = b"POST /stop HTTP/1.1\r\n\r\n"
FORBIDDEN = (
    *("fastapi", "starlette", "uvicorn", "pydantic", "asyncio", "cv2", "onnxruntime", "mujoco"),
    *(
        "vla_deploy.plans.plan",
        "vla_deploy.skills",
        "vla_deploy.cli",
        "vla_deploy.dashboard.app",
    ),
)


@pytest.fixture
def taken_port():
    with closing(socket.create_server(("127.0.0.1", 0))) as other:
        yield other.getsockname()[1]


def test_it_tells_where_it_is_open(doorway):
    told = doorway.told()
    assert (told["open"], told["host"], told["scheme"], told["why"]) == (
        *(True, "127.0.0.1", "http"),
        "",
    )
    socket.create_connection(("127.0.0.1", told["port"])).close()


def test_where_its_port_is_taken_it_says_so_and_opens_as_soon_as_it_is_free(doorway):
    doorway.node.stop()
    with closing(socket.create_server(("127.0.0.1", 0))) as other:
        port = other.getsockname()[1]
        doorway.settings = lambda: DashboardSettings(stop_port=port)
        closed = StopDoorNode(doorway.space, doorway.clock, doorway.settings)
        closed.start()
        told = doorway.told()
        assert (told["open"], told["port"]) == (False, port)
        assert f"127.0.0.1:{port}: another program listens there" in told["why"]
    doorway.clock.advance(0.9)
    closed.step()
    assert not doorway.told()["open"]
    doorway.clock.advance(0.1)
    closed.step()
    doorway.clock.advance(0.5)
    closed.step()
    assert doorway.told()["open"]
    closed.stop()


def test_a_spoilt_settings_file_does_not_keep_the_door_shut(doorway, monkeypatch):
    def spoilt():
        raise DashboardSettingsInvalid(
            ("dashboard.toml: port: expected a port, 1 to 65535, got 'x'",)
        )

    monkeypatch.setattr(
        "vla_deploy.stop_door.node.DEFAULTS", replace(DashboardSettings(), stop_port=0)
    )
    node = StopDoorNode(doorway.space, doorway.clock, spoilt)
    node.start()
    told = doorway.told()
    assert (told["open"], told["host"]) == (True, "127.0.0.1")
    assert told["why"].startswith("dashboard.toml: port: expected")
    node.stop()


def test_a_restarted_door_of_a_twin_opens_where_open_pages_look_for_it(doorway):
    port = doorway.told()["port"]
    doorway.node.stop()
    again = StopDoorNode(doorway.space, doorway.clock, doorway.settings, search=True)
    again.start()
    assert doorway.told()["port"] == port
    again.stop()


def test_a_robots_twin_takes_the_next_free_port(doorway, taken_port):
    settings = DashboardSettings(stop_port=taken_port)
    doorway.node.stop()
    doorway.space.cell_writer("stop_door_status").put_document({"port": None})
    twin = StopDoorNode(doorway.space, doorway.clock, lambda: settings, search=True)
    twin.start()
    assert doorway.told()["open"]
    assert doorway.told()["port"] > taken_port
    twin.stop()


@pytest.fixture
def certificate(tmp_path):
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("needs openssl to make a certificate")
    made = tmp_path / "robot.pem", tmp_path / "robot.key"
    subprocess.run(
        [
            *(openssl, "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256"),
            *("-nodes", "-days", "1", "-subj", "/CN=robot", "-addext", "subjectAltName=DNS:robot"),
            *("-out", str(made[0]), "-keyout", str(made[1])),
        ],
        check=True,
        capture_output=True,
    )
    return made


@pytest.fixture
def secured(doorway, certificate):
    doorway.node.stop()
    settings = DashboardSettings(
        stop_port=0, tls_certificate=str(certificate[0]), tls_key=str(certificate[1])
    )
    doorway.node = StopDoorNode(doorway.space, doorway.clock, lambda: settings)
    doorway.node.start()
    return doorway


def test_who_breaks_off_before_tls_begins_costs_nobody_else_their_place(secured):
    with closing(secured.call()):
        secured.node.step()
        for _ in range(20):
            hasty = secured.call()
            hasty.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
            hasty.close()
        secured.node.step()
        told = secured.tell()
        assert (told["connections"], told["crowded_out"]) == (1, 0)


def test_with_a_certificate_it_speaks_tls_alone(secured, certificate):
    doorway = secured
    assert doorway.told()["scheme"] == "https"
    assert doorway.ask(PRESS) == b""
    assert doorway.pressed() == []
    assert doorway.answer(_SecureClient(doorway.call(), certificate[0])).startswith(
        b"HTTP/1.1 200 OK"
    )
    assert len(doorway.pressed()) == 1


class _SecureClient:
    """Speak TLS over a socket that never waits, one try a call."""

    def __init__(self, plain, authority):
        context = ssl.create_default_context(cafile=authority)
        self._secure = context.wrap_socket(
            plain, server_hostname="robot", do_handshake_on_connect=False
        )
        self._sent = False

    def recv(self, count):
        try:
            if not self._sent:
                self._secure.do_handshake()
                self._secure.sendall(PRESS)
                self._sent = True
            data = self._secure.recv(count)
        except (ssl.SSLWantReadError, ssl.SSLWantWriteError) as error:
            raise BlockingIOError from error
        if not data:
            self._secure.close()
        return data


def test_a_certificate_that_cannot_be_used_is_named(doorway, tmp_path):
    settings = DashboardSettings(stop_port=0, tls_certificate=str(tmp_path), tls_key="missing.pem")
    node = StopDoorNode(doorway.space, doorway.clock, lambda: settings)
    node.start()
    told = doorway.told()
    assert not told["open"]
    assert f"tls_certificate {tmp_path}: Is a directory" in told["why"]


def test_the_door_imports_nothing_that_could_hold_it_up() -> None:
    probe = (
        "import sys, vla_deploy.stop_door.__main__\n"
        f"bad = [name for name in {FORBIDDEN!r} if name in sys.modules]\n"
        "assert not bad, bad\n"
    )
    subprocess.run([sys.executable, "-c", probe], check=True, timeout=30)
