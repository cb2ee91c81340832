"""What a robot file may say of zones and margins, and every fault of it by name."""

import shutil
from pathlib import Path

import pytest

from vla_deploy.robots import load_robot
from vla_deploy.robots.errors import RobotFileError
from vla_deploy.robots.loader import ROBOTS_DIR
from vla_deploy.robots.protection import ZoneKind, ZoneSource

BUTLER = ROBOTS_DIR / "butler"
MARKER = "# --- groups ---"
PLAIN = (
    (BUTLER / "robot.toml").read_text(encoding="utf-8").split("# --- zones and margins ---")[0]
    + MARKER
    + (BUTLER / "robot.toml").read_text(encoding="utf-8").split(MARKER, 1)[1]
)
SQUARE = "[[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]]"


def write(folder: Path, addition: str) -> Path:
    shutil.copytree(BUTLER, folder, dirs_exist_ok=True)
    text = PLAIN.replace(MARKER, f"{addition}\n{MARKER}", 1)
    (folder / "robot.toml").write_text(text, encoding="utf-8")
    return folder


def test_a_robot_that_declares_nothing_has_no_zones_and_the_usual_margins(tmp_path: Path) -> None:
    protection = load_robot(write(tmp_path, "")).protection
    assert protection.zones == ()
    assert protection.workspaces == {}
    assert protection.tip_over is None
    assert protection.contact is None
    assert protection.clearance.self_m > 0.0


def test_a_limit_zone_becomes_the_more_restrictive_ratio(tmp_path: Path) -> None:
    zone = f"""[zones.busy]
kind = "limit"
sources = ["depth", "lidar"]
polygon_m = {SQUARE}
speed_m_s = 0.2
turn_rad_s = 0.3"""
    (found,) = load_robot(write(tmp_path, zone)).protection.zones
    assert found.kind is ZoneKind.LIMIT
    assert found.sources == (ZoneSource.DEPTH, ZoneSource.LIDAR)
    assert found.speed_ratio == pytest.approx(0.2)
    assert (found.min_points, found.trigger_count) == (2, 1)


FAULTS = [
    ('[zones.a]\nkind = "halt"\nsources = ["lidar"]', "zones.a.kind"),
    (f'[zones.a]\nkind = "stop"\nsources = []\npolygon_m = {SQUARE}', "zones.a.sources"),
    ('[zones.a]\nkind = "stop"\nsources = ["lidar"]', "zones.a.polygon_m"),
    (
        f'[zones.a]\nkind = "slow"\nsources = ["lidar"]\npolygon_m = {SQUARE}',
        "zones.a.speed_ratio",
    ),
    (
        f'[zones.a]\nkind = "slow"\nsources = ["lidar"]\npolygon_m = {SQUARE}\nspeed_ratio = 1.2',
        "zones.a.speed_ratio",
    ),
    (f'[zones.a]\nkind = "limit"\nsources = ["lidar"]\npolygon_m = {SQUARE}', "zones.a"),
    (
        '[zones.a]\nkind = "approach"\nsources = ["lidar"]\ntime_before_collision_s = 1.0\n'
        f"polygon_m = {SQUARE}",
        "zones.a.polygon_m",
    ),
    (
        f'[zones.a]\nkind = "stop"\nsources = ["lidar"]\npolygon_m = {SQUARE}\nmin_points = 0',
        "zones.a.min_points",
    ),
    ("[workspace.third]\nmin_m = [0, 0, 0]\nmax_m = [1, 1, 1]", "workspace.third"),
    ("[workspace.left]\nmin_m = [0, 2, 0]\nmax_m = [1, 1, 1]", "workspace.left.min_m"),
    ("[workspace.left]\nmin_m = [0, 2]\nmax_m = [1, 1, 1]", "workspace.left.min_m"),
    ("[clearance]\nself_m = -0.1", "clearance.self_m"),
    ('[clearance]\nallow = [["torso_shell", "left_hook"]]', "clearance.allow[0]"),
    ('[clearance]\nallow = [["torso_shell"]]', "clearance.allow"),
    (
        "[tip_over]\nmax_lean_rad = 0.3\nmin_ratio = 0.2\n"
        "support_m = [[0.2, 0.1], [0.2, -0.1], [-0.2, 0.0]]",
        "tip_over.support_m",
    ),
    (
        "[tip_over]\nmax_lean_rad = 3.0\nmin_ratio = 0.2\n"
        "support_m = [[0.2, -0.1], [0.2, 0.1], [-0.2, 0.0]]",
        "tip_over.max_lean_rad",
    ),
    ("[contact]\ntorque_nm = { left_knee = 2.0 }", "contact.torque_nm.left_knee"),
    ("[contact]\ntorque_nm = { left_elbow = 40.0 }", "contact.torque_nm.left_elbow"),
    ("[contact]", "contact.torque_nm"),
]


@pytest.mark.parametrize(("addition", "key"), FAULTS, ids=[key for _, key in FAULTS])
def test_each_fault_is_told_with_its_key(tmp_path: Path, addition: str, key: str) -> None:
    with pytest.raises(RobotFileError) as caught:
        load_robot(write(tmp_path, addition))
    assert key in [fault.key for fault in caught.value.faults]


def test_butlers_zones_reach_no_further_than_the_furniture_it_works_at() -> None:
    robot = load_robot("butler")
    reach_m = {
        zone.name: max(abs(value) for corner in zone.polygon_m for value in corner)
        for zone in robot.protection.zones
        if zone.polygon_m
    }
    assert reach_m["contact"] < robot.base.footprint_radius_m + 0.018
    assert reach_m["overhang"] < robot.base.footprint_radius_m + 0.005
