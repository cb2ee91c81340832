"""The doctor says whether page and stop door could be served."""

import socket

import pytest

from vla_deploy.doctor import dashboard as check
from vla_deploy.doctor.finding import FindingLevel
from vla_deploy.runtime.state_dir import config_dir_of


@pytest.fixture
def findings(tmp_path, monkeypatch):
    base = tmp_path / "base"
    config_dir_of(base).mkdir()
    monkeypatch.setattr(check, "default_base", lambda: base)

    def examine(text):
        (config_dir_of(base) / "dashboard.toml").write_text(text)
        return {one.name: one for one in check.dashboard(None)}

    return examine


@pytest.fixture
def ports():
    with (
        socket.create_server(("127.0.0.1", 0)) as one,
        socket.create_server(("127.0.0.1", 0)) as two,
    ):
        yield one.getsockname()[1], two.getsockname()[1]


def test_a_taken_port_is_told_with_the_command_that_finds_who_has_it(findings, ports):
    found = findings(f"port = {ports[0]}\nstop_port = {ports[1]}")
    for name, port in zip(("dashboard, page", "dashboard, stop door"), ports, strict=True):
        assert found[name].level is FindingLevel.WARN
        assert found[name].remedy == f"sudo ss -ltnp 'sport = :{port}'"


def test_faults_of_the_file_are_told(findings):
    found = findings("port = 0")["dashboard"]
    assert (found.level, "expected a port" in found.measured) == (FindingLevel.FAIL, True)


def test_passwords_in_the_clear_are_warned_of_where_others_reach_the_page(findings):
    assert findings('host = "0.0.0.0"')["dashboard, TLS"].level is FindingLevel.WARN
    assert "dashboard, TLS" not in findings('host = "127.0.0.1"')


def test_a_certificate_that_cannot_be_read_is_told(findings, tmp_path):
    (tmp_path / "cert.pem").touch()
    text = f'tls_certificate = "{tmp_path}/cert.pem"\ntls_key = "{tmp_path}/key.pem"'
    found = findings(text)["dashboard, TLS"]
    assert (found.level, "key.pem: No such file" in found.measured) == (FindingLevel.FAIL, True)
