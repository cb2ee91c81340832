import shutil
import socket
import sys

import pytest

from vla_deploy.doctor import FindingLevel, software
from vla_deploy.inference.store import EMBEDDED
from vla_deploy.runtime.state_dir import config_dir_of


@pytest.mark.parametrize(
    ("version", "level"),
    [
        ((3, 10, 12), FindingLevel.FAIL),
        ((3, 11, 0), FindingLevel.OK),
        ((3, 13, 9), FindingLevel.OK),
        ((3, 14, 0), FindingLevel.FAIL),
    ],
)
def test_the_interpreter_is_one_that_is_supported(computer, monkeypatch, version, level) -> None:
    monkeypatch.setattr(sys, "version_info", version)
    (finding,) = software.python(computer.context())
    assert finding.level is level


def test_every_required_package_is_installed_here(computer) -> None:
    findings = list(software.packages(computer.context()))
    assert findings[0].level is FindingLevel.OK
    assert int(findings[0].measured.split()[1]) >= 10


def test_a_package_that_is_not_there_fails_with_the_line_that_installs_it(
    computer, monkeypatch
) -> None:
    rows = ["numpy>=2", "no-such-package-of-ours>=1,<2", "gpiod; extra == 'gpio'"]
    monkeypatch.setattr(software.importlib.metadata, "requires", lambda name: rows)
    finding = next(software.packages(computer.context()))
    assert (finding.level, finding.remedy) == (
        FindingLevel.FAIL,
        "pip install no-such-package-of-ours",
    )


def put_model(folder, name, *, is_whole=True):
    """Copy a model that comes with the software into a folder, under another name."""
    shutil.copytree(EMBEDDED / "stop_words", folder / name)
    manifest = folder / name / "model.toml"
    manifest.write_text(manifest.read_text().replace("stop_words", name, 1))
    if not is_whole:
        (folder / name / "stop_words.onnx").write_bytes(b"half")


def test_models_that_are_not_there_are_named(computer) -> None:
    put_model(computer.root / "embedded", "medium")
    put_model(computer.root / "added", "small")
    found = {one.name: one for one in software.models(computer.context("robot"))}
    assert (found["detector"].level, found["detector"].measured) == (
        FindingLevel.OK,
        "medium, small",
    )
    assert (found["planner"].level, found["planner"].measured) == (
        FindingLevel.WARN,
        "no model planner_1b",
    )


def test_a_model_that_was_cut_off_is_told(computer) -> None:
    put_model(computer.root / "embedded", "medium")
    put_model(computer.root / "added", "small", is_whole=False)
    found = {one.name: one for one in software.models(computer.context("robot"))}
    assert found["detector"].level is FindingLevel.WARN
    assert "expected SHA-256" in found["detector"].measured


def test_a_folder_without_a_manifest_is_no_model(computer) -> None:
    (computer.root / "embedded/medium").mkdir(parents=True)
    found = {one.name: one for one in software.models(computer.context("robot"))}
    assert found["detector"].measured == "no model medium; no model small"


@pytest.mark.parametrize(
    ("answer", "level"),
    [
        ("ActiveState=active\nNRestarts=0\nResult=success\n", FindingLevel.OK),
        ("ActiveState=failed\nNRestarts=5\nResult=watchdog\n", FindingLevel.FAIL),
        ("ActiveState=inactive\nNRestarts=0\nResult=success\n", FindingLevel.WARN),
        ("", FindingLevel.WARN),
    ],
)
def test_the_service_is_judged_by_what_systemd_says(computer, answer, level) -> None:
    (absent,) = software.service(computer.context())
    assert (absent.level, absent.remedy) == (FindingLevel.MISSING, "sudo vla-deploy install")
    computer.write("/etc/systemd/system/vla-deploy.service", "[Unit]\n")
    computer.answers["systemctl"] = answer
    (finding,) = software.service(computer.context())
    assert finding.level is level


def test_without_egl_the_packages_are_named(computer) -> None:
    (finding,) = software.open_gl(computer.context())
    assert finding.level is FindingLevel.WARN
    assert "apt-get install -y libegl1" in finding.remedy
    computer.answers[sys.executable] = "EGL 1.5\n"
    (finding,) = software.open_gl(computer.context())
    assert (finding.level, finding.measured) == (FindingLevel.OK, "EGL 1.5")


@pytest.fixture
def findings(tmp_path, monkeypatch):
    base = tmp_path / "base"
    config_dir_of(base).mkdir()
    monkeypatch.setattr(software, "default_base", lambda: base)

    def examine(text):
        (config_dir_of(base) / "dashboard.toml").write_text(text)
        return {one.name: one for one in software.dashboard(None)}

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
