"""Settings are read whole or every fault is named; unusable ports and certificates say why."""

import shutil
import socket
import ssl
import subprocess
import threading

import pytest

from vla_deploy.runtime.net import (
    DashboardSettings,
    DashboardSettingsInvalid,
    PortTaken,
    TlsUnusable,
    open_port,
    read_settings,
    server_context,
)
from vla_deploy.runtime.state_dir import config_dir_of


@pytest.fixture
def write(tmp_path):
    base = tmp_path / "base"

    def written(text):
        config_dir_of(base).mkdir(exist_ok=True)
        (config_dir_of(base) / "dashboard.toml").write_text(text)
        return base

    return written


def test_without_a_file_the_defaults_hold_and_nobody_elsewhere_is_served(tmp_path):
    settings = read_settings(tmp_path / "base")
    assert settings == DashboardSettings()
    assert (settings.host, settings.port, settings.stop_port) == ("127.0.0.1", 8088, 8089)


def test_a_file_says_what_differs(write):
    text = 'host = "0.0.0.0"\nport = 80\nallowed_hosts = ["robot.lan"]\ntrust_loopback = false\n'
    settings = read_settings(write(text))
    assert (settings.host, settings.port) == ("0.0.0.0", 80)
    assert (settings.allowed_hosts, settings.trust_loopback) == (("robot.lan",), False)
    assert settings.scheme == "http"


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("port = ", "expected a TOML document"),
        ("prot = 80", "prot: unknown, expected one of host, port"),
        ("port = 0", "port: expected a port, 1 to 65535, got 0"),
        ("port = true", "port: expected a port"),
        ('port = "80"', "port: expected a port, 1 to 65535, got '80'"),
        ("port = 8089", "stop_port: expected another port than the dashboard's"),
        ('host = ""', "host: expected an address or a name"),
        ('allowed_hosts = "robot"', "allowed_hosts: expected a list of host names"),
        ("trust_loopback = 1", "trust_loopback: expected true or false"),
        ('tls_key = "key.pem"', "tls_certificate, tls_key: expected both or neither"),
    ],
)
def test_a_fault_is_told_with_file_key_and_what_is_expected(write, text, fault):
    with pytest.raises(DashboardSettingsInvalid) as error:
        read_settings(write(text))
    assert fault in str(error.value)
    assert "dashboard.toml: " in str(error.value)


def test_all_faults_are_told_at_once(write):
    with pytest.raises(DashboardSettingsInvalid) as error:
        read_settings(write("port = 0\nstop_port = -1\nprot = 1\n"))
    assert len(error.value.faults) == 3


HOST = "127.0.0.1"


@pytest.fixture
def taken():
    with socket.create_server((HOST, 0)) as other:
        yield other.getsockname()[1]


def test_a_taken_port_is_an_error_that_names_it_and_says_what_to_do(taken):
    with pytest.raises(PortTaken, match=rf"127.0.0.1:{taken}: another program.*ss -ltnp"):
        open_port(HOST, taken, search=False)


def test_where_runs_share_a_computer_the_next_pair_of_ports_is_taken(taken):
    with open_port(HOST, taken, search=True) as found:
        assert found.getsockname()[1] in range(taken + 2, taken + 400, 2)


def test_an_instance_after_the_first_listens_where_open_pages_look(taken):
    with open_port(HOST, taken, search=True) as first:
        before = first.getsockname()[1]
    with open_port(HOST, taken - 40, search=True, before=before) as second:
        assert second.getsockname()[1] == before


@pytest.mark.parametrize("host", ["192.0.2.1", "no.such.host.invalid"])
def test_an_address_that_is_not_this_computers_is_told(host):
    with pytest.raises(PortTaken, match=r"cannot listen there: .*dashboard\.toml"):
        open_port(host, 0, search=True)


def openssl(*arguments):
    program = shutil.which("openssl")
    if program is None:
        pytest.skip("needs openssl to make a certificate")
    subprocess.run([program, *map(str, arguments)], check=True, capture_output=True)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A certificate and its key, another key, and the first one behind a password."""
    folder = tmp_path_factory.mktemp("tls")
    curve = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256")
    for name in ("robot", "other"):
        files = ("-keyout", folder / f"{name}.key", "-out", folder / f"{name}.pem")
        openssl("req", "-x509", *curve, "-nodes", "-days", "1", "-subj", "/CN=robot", *files)
    locked = ("-out", folder / "locked.key", "-aes256", "-passout", "pass:secret")
    openssl("pkey", "-in", folder / "robot.key", *locked)
    for key in folder.glob("*.key"):
        key.chmod(0o600)
    return folder


def test_certificate_and_key_speak_tls_and_nothing_older(made):
    context = server_context(str(made / "robot.pem"), str(made / "robot.key"))
    ours, theirs = socket.socketpair()
    trusting = ssl.create_default_context(cafile=str(made / "robot.pem"))
    trusting.check_hostname = False
    shake = threading.Thread(
        target=lambda: context.wrap_socket(ours, server_side=True).close(), daemon=True
    )
    shake.start()
    with trusting.wrap_socket(theirs) as secure:
        assert secure.version() in ("TLSv1.2", "TLSv1.3")
    shake.join()
    assert context.minimum_version is ssl.TLSVersion.TLSv1_2


@pytest.mark.parametrize(
    ("certificate", "key", "said"),
    [
        ("missing.pem", "robot.key", "tls_certificate .*No such file"),
        ("robot.pem", "missing.key", "tls_key .*No such file"),
        ("robot.pem", "", "tls_key .*Is a directory"),
        ("robot.pem", "other.key", "belong together"),
        ("robot.pem", "locked.key", "needs a password"),
        ("robot.key", "robot.key", "expected PEM"),
    ],
)
def test_what_is_wrong_with_them_is_said_with_what_to_try(made, certificate, key, said):
    with pytest.raises(TlsUnusable, match=said):
        server_context(str(made / certificate), str(made / key))


def test_a_key_that_everybody_may_read_is_none(made):
    key = made / "open.key"
    key.write_bytes((made / "robot.key").read_bytes())
    key.chmod(0o644)
    with pytest.raises(TlsUnusable, match="chmod 640"):
        server_context(str(made / "robot.pem"), str(key))
