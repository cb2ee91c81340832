"""Run the real process: it serves at both doors, ends in order, and says why it cannot start."""

import json
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from pathlib import Path

import pytest
from httpx import Client
from websockets.sync.client import connect

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.client.access.local_token import local_headers
from vla_deploy.client.access.login_link import login_url
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.state_dir import config_dir_of

pytestmark = [pytest.mark.stack]

CLOCK = MonotonicClock()
START_S = 40.0


class Process:
    def __init__(self, base: Path) -> None:
        self.run_dir = base / "20260101-000000-1"
        self.run_dir.mkdir(parents=True, exist_ok=True)
        self.space = SharedSpace(self.run_dir / "ipc", CLOCK)
        words = ["--run-dir", str(self.run_dir), "--robot", "butler", "--profile", "desktop"]
        self.popen = subprocess.Popen(
            [sys.executable, "-m", "vla_deploy.dashboard", *words],
            stderr=subprocess.PIPE,
            text=True,
        )

    def url(self) -> tuple[str, int]:
        status = self.space.cell_reader("dashboard_status")
        end_ns = CLOCK.now_ns() + round(START_S * NS_PER_S)
        while CLOCK.now_ns() < end_ns and self.popen.poll() is None:
            sample = status.latest()
            if sample is not None and sample.writer_pid == self.popen.pid:
                return sample.document()["host"], sample.document()["port"]
            CLOCK.sleep_until(CLOCK.now_ns() + NS_PER_S // 50)
        raise AssertionError(self.popen.communicate()[1])

    def end_by_itself(self) -> tuple[int, str]:
        _, words = self.popen.communicate(timeout=START_S)
        self.space.close()
        return self.popen.returncode, words

    def end(self) -> tuple[int, str]:
        if self.popen.poll() is None:
            self.popen.terminate()
        _, words = self.popen.communicate(timeout=20)
        self.space.close()
        return self.popen.returncode, words


@pytest.fixture
def base():
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:
        yield Path(folder) / "base"


def set_port(base: Path, port: int, more: str = "") -> None:
    config_dir_of(base).mkdir(parents=True)
    text = f"port = {port}\nstop_port = {port + 1}\n{more}"
    (config_dir_of(base) / "dashboard.toml").write_text(text)


def test_it_serves_by_tcp_and_by_its_socket_and_ends_at_once_with_a_client_that_stays(
    base, unused_port
):
    set_port(base, unused_port())
    process = Process(base)
    host, port = process.url()
    staying = HTTPConnection(host, port, timeout=10)
    staying.request("GET", "/api/v1/state", headers=local_headers(base))
    answer = staying.getresponse()
    assert json.load(answer)["dashboard_url"] == f"http://{host}:{port}"
    assert "server" not in answer.headers

    local = HTTPConnection("robot", timeout=10)
    local.sock = socket.socket(socket.AF_UNIX)
    local.sock.connect(str(process.run_dir / "dashboard.sock"))
    local.request("GET", "/healthz")
    assert json.load(local.getresponse()) == {"answers": True}

    link = login_url(process.run_dir, f"http://{host}:{port}")
    page, _, code = link.partition("/#/login/")
    with Client(base_url=f"{page}/api/v1") as browser:
        assert browser.post("login/code", json={"code": code}).json()["user"] == "local"
        assert browser.get("state").status_code == 200

    began_ns = CLOCK.now_ns()
    code, words = process.end()
    assert (code, words) == (0, "")
    assert CLOCK.now_ns() - began_ns < 9 * NS_PER_S  # the client would stay for ten
    staying.close()
    local.close()


def test_a_taken_port_and_a_faulty_file_are_for_a_person_to_mend(base):
    with socket.create_server(("127.0.0.1", 0)) as other:
        set_port(base, other.getsockname()[1])
        code, words = Process(base).end_by_itself()
    assert code == 2
    assert "another program listens there" in words
    (config_dir_of(base) / "dashboard.toml").write_text("port = 0")
    code, words = Process(base).end_by_itself()
    assert (code, "expected a port, 1 to 65535, got 0" in words) == (2, True)


@pytest.fixture
def certified(base):
    """A certificate for 127.0.0.1 and its key, as settings and as whom a client trusts."""
    openssl = shutil.which("openssl")
    assert openssl is not None, "scripts/system-packages installs openssl"
    folder = base.parent
    certificate, key = folder / "robot.pem", folder / "robot.key"
    words = ["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"]
    words += ["-days", "1", "-subj", "/CN=robot", "-addext", "subjectAltName=IP:127.0.0.1"]
    command = [openssl, *words, "-keyout", str(key), "-out", str(certificate)]
    subprocess.run(command, check=True, capture_output=True)
    key.chmod(0o600)
    settings = f'tls_certificate = "{certificate}"\ntls_key = "{key}"\n'
    return settings, ssl.create_default_context(cafile=str(certificate))


def test_with_a_certificate_everything_goes_by_tls_and_nothing_without(
    base, certified, unused_port
):
    settings, trusting = certified
    set_port(base, unused_port(), settings)
    process = Process(base)
    host, port = process.url()
    secure = HTTPSConnection(host, port, timeout=10, context=trusting)
    secure.request("GET", "/api/v1/state", headers=local_headers(base))
    answer = secure.getresponse()
    assert json.load(answer)["dashboard_url"] == f"https://{host}:{port}"
    with connect(
        f"wss://{host}:{port}/api/v1/live",
        ssl=trusting,
        origin=f"https://{host}:{port}",
        additional_headers=local_headers(base),
    ) as live:
        live.send(json.dumps({"subscribe": ["dashboard_status"]}))
        topics = (json.loads(live.recv(timeout=10))["topic"] for _ in range(5))
        assert "dashboard_status" in topics
    plain = HTTPConnection(host, port, timeout=10)
    with pytest.raises((HTTPException, ConnectionError)):
        plain.request("GET", "/api/v1/state")
        plain.getresponse()
    plain.close()
    secure.close()
    assert process.end() == (0, "")
