"""What is written follows robot file, profile and layout, and systemd accepts it."""

import json
import os
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from platforms import load_profile
from vla_deploy.cli.main import main
from vla_deploy.install import Credential, InstallError, InstallLayout, ServiceChoice, system_files
from vla_deploy.install.commands import before_uninstall
from vla_deploy.install.errors import TemplateBroken
from vla_deploy.install.files import filled, service_profile, slice_too_small
from vla_deploy.robots import load_robot
from vla_deploy.supervisor.systemd import (
    RESTART_S,
    START_BURST,
    start_limit_s,
    watchdog_s,
)

ROBOT = load_robot("butler")
PROFILE = load_profile("desktop")
MOST_EXPOSURE = 2.6
SERVICES = (
    "vla-deploy.service",
    "vla-deploy-can.service",
    "vla-deploy-gave-up.service",
    "vla-deploy-power@.service",
)


def texts(choice: ServiceChoice | None = None, **robot: object) -> dict[str, str]:
    changed = replace(ROBOT, **robot)  # type: ignore[arg-type]
    files = system_files(changed, PROFILE, choice or ServiceChoice(), InstallLayout())
    return {file.path.name: file.text for file in files}


@pytest.fixture(scope="module")
def units(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Install into a prefix that is really there, so that systemd finds every program."""
    root = tmp_path_factory.mktemp("computer")
    program = root / "opt/current/bin/vla-deploy"
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    layout = InstallLayout(prefix=root / "opt")
    for file in system_files(ROBOT, PROFILE, ServiceChoice(), layout):
        inside = file.path.is_relative_to(root)
        path = file.path if inside else root / file.path.relative_to("/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(file.text)
        path.chmod(file.mode)
    return root / "etc/systemd/system"


def test_systemd_finds_nothing_wrong_with_the_units(units: Path) -> None:
    environment = {**os.environ, "SYSTEMD_UNIT_PATH": f"{units}:"}
    paths = [str(path) for path in sorted(units.iterdir())]
    done = subprocess.run(
        ["systemd-analyze", "verify", *paths], env=environment, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("name", SERVICES)
def test_a_unit_exposes_little(units: Path, name: str) -> None:
    command = ["systemd-analyze", "security", "--offline=yes", "--json=short"]
    limit = [f"--threshold={round(MOST_EXPOSURE * 10)}"]
    done = subprocess.run([*command, *limit, str(units / name)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-300:]
    assert len(json.loads(done.stdout)) > 50


def test_the_unit_runs_what_was_chosen() -> None:
    choice = ServiceChoice(
        robot="/etc/vla-deploy/robots/mine",
        profile="jetson_orin_nx",
        watchdog_s=7,
        credentials=(Credential(name="planner_key", path=Path("/etc/vla-deploy/key")),),
    )
    unit = texts(choice)["vla-deploy.service"]
    assert "run --robot /etc/vla-deploy/robots/mine --profile jetson_orin_nx\n" in unit
    assert "WatchdogSec=7\n" in unit
    assert "LoadCredential=planner_key:/etc/vla-deploy/key\n" in unit


def test_the_unit_is_as_patient_as_the_process_table_asks() -> None:
    unit = texts()["vla-deploy.service"]
    for line in (
        f"WatchdogSec={watchdog_s()}",
        f"RestartSec={RESTART_S}",
        f"StartLimitBurst={START_BURST}",
        f"StartLimitIntervalSec={start_limit_s()}",
    ):
        assert f"\n{line}\n" in unit


def test_the_slice_leaves_room_for_page_cache_above_the_profiles_budget() -> None:
    budget = round(PROFILE.total.memory_mb)
    limits = f"MemoryHigh={round(budget * 1.5)}M\nMemoryMax={round(budget * 1.75)}M\n"
    assert limits in texts()["vla-deploy.slice"]


def test_the_robot_may_ask_for_a_power_mode_where_the_board_has_modes() -> None:
    files = texts()
    assert "Wants=vla-deploy-power.socket\n" in files["vla-deploy.service"]
    assert "ConditionFileIsExecutable=/usr/sbin/nvpmodel\n" in files["vla-deploy-power.socket"]
    assert "SocketGroup=vla-deploy\nSocketMode=0660\n" in files["vla-deploy-power.socket"]


def test_a_template_of_units_is_not_stopped_by_its_name() -> None:
    files = system_files(ROBOT, PROFILE, ServiceChoice(), InstallLayout())
    (command,) = before_uninstall(file.path for file in files)
    assert "vla-deploy-power.socket" in command
    assert not [word for word in command if "@" in word]


def test_the_can_link_has_the_robots_bitrate() -> None:
    assert "link set can0 up type can bitrate 1000000 " in texts()["vla-deploy-can.service"]


@pytest.mark.parametrize("path", ["slcan:/dev/serial/by-id/usb-x-if00", "/run/can-hub"])
def test_a_bus_that_is_no_network_interface_needs_no_link(path: str) -> None:
    can_bus = replace(ROBOT.can_bus, path=path)
    files = texts(parts=replace(ROBOT.parts, can_bus=can_bus))
    assert "vla-deploy-can.service" not in files


def test_the_twin_needs_neither_link_nor_devices() -> None:
    files = texts(ServiceChoice(twin=True))
    assert "vla-deploy-can.service" not in files
    assert "SYMLINK" not in files["70-vla-deploy.rules"]
    assert "run --robot butler --twin\n" in files["vla-deploy.service"]


def test_every_usb_device_gets_a_name_that_stays() -> None:
    rules = texts()["70-vla-deploy.rules"]
    for name in ("servos", "lidar", "estop"):
        assert f'SYMLINK+="vla-deploy/{name}"' in rules
    assert 'ENV{ID_SERIAL}=="FTDI_USB__-__Serial_Converter_FT6S4DSP", SYMLINK' in rules
    assert 'ATTR{latency_timer}="1"' in rules


def test_the_user_exists_with_its_groups_and_nothing_else(tmp_path: Path) -> None:
    assert main(["install", "--root", str(tmp_path)]) == 0
    (tmp_path / "etc").mkdir(exist_ok=True)
    command = ["systemd-sysusers", f"--root={tmp_path}", "vla-deploy.conf"]
    subprocess.run(command, check=True, capture_output=True)
    groups = (tmp_path / "etc/group").read_text().splitlines()
    mine = {line.split(":")[0] for line in groups if line.endswith("vla-deploy")}
    assert mine == {"dialout", "video", "audio", "input", "gpio", "render"}


@pytest.mark.parametrize("name", ["two words", "a%b", "a\nExecStartPost=/bin/sh", ""])
def test_what_cannot_stand_in_a_unit_is_refused(name: str) -> None:
    with pytest.raises(InstallError, match="cannot stand in a unit"):
        texts(ServiceChoice(robot=name))


def test_the_topics_of_a_robot_that_runs_for_days_are_not_cleaned_away(tmp_path: Path) -> None:
    topics = tmp_path / "dev" / "shm" / "vla-deploy-0-20260101-000000-1"
    other = topics.with_name("other")
    for folder in (topics, other):
        folder.mkdir(parents=True)
        (folder / "operator").touch()
    assert main(["install", "--root", str(tmp_path)]) == 0
    rules = tmp_path / "usr/lib/tmpfiles.d/vla-deploy.conf"
    system = tmp_path / "usr/lib/tmpfiles.d/a-system.conf"
    system.write_text("d /dev/shm - - - 0\n")  # whatever is there is too old
    command = ["systemd-tmpfiles", "--clean", f"--root={tmp_path}", str(system), str(rules)]
    subprocess.run(command, capture_output=True, check=False)  # this root has no such users
    assert not (other / "operator").exists()
    assert (topics / "operator").exists()


def test_a_template_with_an_unknown_name_is_refused() -> None:
    with pytest.raises(TemplateBroken, match="x: nobody fills in NEW"):
        filled("User=@USER@\nGroup=@NEW@\n", {"USER": "me"}, "x")


def test_system_call_groups_are_no_placeholders() -> None:
    assert filled("SystemCallFilter=@system-service\n", {}, "x") == (
        "SystemCallFilter=@system-service\n"
    )


CHOSEN, OTHER = "jetson_orin_nano_8gb", "jetson_orin_nx"


def choose(library: Path, name: str) -> None:
    library.mkdir(parents=True)
    (library / "profile.json").write_text(json.dumps({"profile": name}))


def memory_high(name: str) -> str:
    return f"MemoryHigh={load_profile(name).total.memory_mb * 1.5:.0f}M\n"


@pytest.mark.parametrize(
    ("words", "name"), [((), CHOSEN), (("--profile", OTHER), OTHER)], ids=["chosen", "given"]
)
def test_the_slice_is_sized_for_the_profile_in_force(
    tmp_path: Path, words: tuple[str, ...], name: str
) -> None:
    choose(tmp_path / "var/lib/vla-deploy", CHOSEN)
    assert main(["install", "--root", str(tmp_path), *words]) == 0
    folder = tmp_path / "etc/systemd/system"
    assert memory_high(name) in (folder / "vla-deploy.slice").read_text()
    priority = load_profile(name).realtime_priority + 10
    assert f"LimitRTPRIO={priority}\n" in (folder / "vla-deploy.service").read_text()


def test_on_this_computer_the_choice_is_the_services_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    choose(tmp_path / "library", CHOSEN)
    monkeypatch.setattr("vla_deploy.runtime.state_dir._ROOT_LIBRARY", tmp_path / "library")
    assert service_profile("", InstallLayout()).name == CHOSEN


def test_a_chosen_file_is_looked_for_inside_the_image(tmp_path: Path) -> None:
    choose(tmp_path / "var/lib/vla-deploy", "/etc/mine.toml")
    assert service_profile("", InstallLayout(root=tmp_path)).name == str(tmp_path / "etc/mine.toml")


def test_a_profile_larger_than_the_installed_slice_is_told(tmp_path: Path) -> None:
    layout, large = InstallLayout(root=tmp_path), load_profile("desktop")
    assert slice_too_small(large, layout) == ""  # nothing is installed
    slice_file = tmp_path / "etc/systemd/system/vla-deploy.slice"
    slice_file.parent.mkdir(parents=True)
    slice_file.write_text(f"[Slice]\nMemoryHigh={large.total.memory_mb:.0f}M\n")
    assert slice_too_small(large, layout) == ""
    slice_file.write_text("[Slice]\nMemoryHigh=100M\n")
    assert "the installed slice allows 100 MB" in slice_too_small(large, layout)
