"""A settings file is taken whole, or every fault of it is told."""

import pytest

from vla_deploy.dashboard.errors import SettingsInvalid
from vla_deploy.dashboard.settings import DashboardSettings, read_settings
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
    with pytest.raises(SettingsInvalid) as error:
        read_settings(write(text))
    assert fault in str(error.value)
    assert "dashboard.toml: " in str(error.value)


def test_all_faults_are_told_at_once(write):
    with pytest.raises(SettingsInvalid) as error:
        read_settings(write("port = 0\nstop_port = -1\nprot = 1\n"))
    assert len(error.value.faults) == 3
