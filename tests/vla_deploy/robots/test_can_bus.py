import re
import shutil
from pathlib import Path

import pytest

from vla_deploy.robots import RobotFileError, load_robot
from vla_deploy.robots.loader import ROBOTS_DIR


@pytest.fixture
def butler_copy(tmp_path: Path) -> Path:
    return Path(shutil.copytree(ROBOTS_DIR / "butler", tmp_path / "butler")) / "robot.toml"


def edit(file: Path, pattern: str, replacement: str) -> None:
    text, count = re.subn(pattern, replacement, file.read_text(), count=1, flags=re.MULTILINE)
    assert count == 1
    file.write_text(text)


def faults_of(file: Path) -> str:
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    return "\n".join(map(str, caught.value.faults))


def test_cia402_in_profile_velocity_needs_no_word(butler_copy: Path) -> None:
    bus = load_robot(butler_copy).can_bus
    assert (bus.protocol, bus.eds_path, bus.endpoints_path) == ("cia402", None, None)
    assert {drive.mode for drive in bus.drives} == {"profile_velocity"}


def test_mode_counts_and_eds_file_are_taken_over(butler_copy: Path) -> None:
    (butler_copy.parent / "mine.eds").write_text("[FileInfo]\n")
    edit(butler_copy, r"^bitrate = .*$", 'bitrate = 500000\neds = "mine.eds"')
    edit(
        butler_copy,
        r"node_id = 1,",
        'node_id = 1, mode = "cyclic_synchronous_velocity", counts_per_rev = 4096,',
    )
    bus = load_robot(butler_copy).can_bus
    assert bus.eds_path == butler_copy.parent / "mine.eds"
    assert (bus.drives[0].mode, bus.drives[0].counts_per_rev) == (
        "cyclic_synchronous_velocity",
        4096,
    )


def test_odrive_needs_its_endpoints_and_its_own_node_ids(butler_copy: Path) -> None:
    edit(butler_copy, r"^bitrate = .*$", 'bitrate = 1000000\nprotocol = "odrive"')
    edit(butler_copy, r"node_id = 1,", "node_id = 63,")
    told = faults_of(butler_copy)
    assert "can_bus.endpoints: got nothing, expected the flat_endpoints.json" in told
    assert "can_bus.drives[0].node_id: got 63, expected an integer in 0..62" in told


def test_a_cia402_drive_has_no_node_0(butler_copy: Path) -> None:
    edit(butler_copy, r"node_id = 1,", "node_id = 0,")
    assert "got 0, expected an integer in 1..126, as cia402 has them" in faults_of(butler_copy)


def test_named_files_must_be_there_and_words_be_known(butler_copy: Path) -> None:
    edit(butler_copy, r"^bitrate = .*$", 'bitrate = 1000000\neds = "gone.eds"\nprotocol = "can"')
    edit(butler_copy, r"node_id = 1,", 'node_id = 1, mode = "torque",')
    told = faults_of(butler_copy)
    assert "can_bus.eds: got 'gone.eds'" in told
    assert "can_bus.protocol: got 'can', expected one of cia402, odrive" in told
    assert "can_bus.drives[0].mode: got 'torque'" in told
