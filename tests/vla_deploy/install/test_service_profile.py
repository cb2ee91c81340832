"""The service's limits follow the profile that it will start with."""

import json
from pathlib import Path

import pytest

from platforms import load_profile
from vla_deploy.cli.main import main
from vla_deploy.install import InstallLayout
from vla_deploy.install.service_profile import service_profile, slice_too_small

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
