import re
from pathlib import Path

import pytest

from vla_deploy.robots import RobotFileError, load_robot, robot_names
from vla_deploy.robots.description import StopCategory
from vla_deploy.robots.loader import ROBOTS_DIR


def edit(file: Path, *changes: tuple[str, str]) -> Path:
    text = file.read_text()
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text, count=1, flags=re.MULTILINE)
        assert count == 1, f"{pattern!r} is not in {file}"
    file.write_text(text)
    return file


def faults_of(file: Path) -> dict[str, str]:
    with pytest.raises(RobotFileError) as caught:
        load_robot(file)
    found: dict[str, str] = {}
    for fault in caught.value.faults:
        found[fault.key] = f"{found.get(fault.key, '')}\n{fault}"
    return found


def test_butler_loads_by_name_by_folder_and_by_file() -> None:
    by_name = load_robot("butler")

    assert by_name == load_robot(ROBOTS_DIR / "butler")
    assert by_name == load_robot(ROBOTS_DIR / "butler" / "robot.toml")
    assert "butler" in robot_names()


def test_joint_order_is_servo_order_and_arrays_follow_it() -> None:
    robot = load_robot("butler")

    assert len(robot.joint_names) == 16
    assert robot.joint_names == tuple(servo.joint for servo in robot.servo_bus.servos)
    for name, index in robot.joint_index.items():
        assert robot.position_min[index] == robot.limits[name].min
        assert robot.velocity_max[index] == robot.limits[name].velocity


def test_arms_keep_power_in_an_emergency_stop_and_the_base_does_not() -> None:
    robot = load_robot("butler")

    assert robot.group("left_arm").stop_category is StopCategory.STOP_KEEP_POWER
    assert robot.group("base").stop_category is StopCategory.STOP_THEN_REMOVE_POWER
    with pytest.raises(KeyError, match="no joint group 'tail'; it has left_arm"):
        robot.group("tail")


def test_device_paths_come_from_the_file_or_from_one_folder() -> None:
    robot = load_robot("butler")

    assert robot.device_path("can") == "can0"
    assert robot.device_path("servos", Path("/run/dev")) == "/run/dev/servos"
    with pytest.raises(KeyError, match="no device 'sonar'"):
        robot.device_path("sonar")


TEN_FAULTS: tuple[tuple[tuple[str, str], str, str], ...] = (
    ((r"^baud = 3000000", "baud = 31337"), "servo_bus.baud", "one of 9600"),
    ((r"id = 2,", "id = 1,"), "servo_bus.servos[1].id", "not used by servo_bus.servos[0].id"),
    ((r'id = 3, model = "XM430-W350"', 'id = 3, model = "XM999"'), "servo_bus.servos[2].model",
     "a key of servo_models"),
    ((r'joint = "left_forearm_roll"', 'joint = "left_knee"'), "servo_bus.servos[3].joint",
     "a joint of the MJCF"),
    ((r"^bitrate = 1000000\n", ""), "can_bus.bitrate", "got nothing"),
    ((r"^track_m = 0.34", "track_m = -0.34"), "base.track_m", "a number above 0"),
    ((r"^left_elbow = \{ min = 0.03", "left_elbow = { min = 9.0"), "limits.left_elbow.min",
     "below max 2.57"),
    ((r"^site = \"imu\"", 'site = "belly"'), "imu.site", "a site of the MJCF"),
    ((r"^head_tilt = 0.8", "head_tilt = 8.0"), "poses.look_down.head_tilt", "inside the limits"),
    ((r"^start = .*", 'start = "attic"\ncolour = "white"'), "home.start", "a place"),
)  # fmt: skip


def test_ten_faults_in_one_file_are_all_reported_with_key_and_expectation(
    butler_copy: Path,
) -> None:
    faults = faults_of(edit(butler_copy, *(change for change, _, _ in TEN_FAULTS)))

    for _, key, words in TEN_FAULTS:
        assert words in faults[key]
    assert "an unknown key" in faults["home.colour"]


@pytest.mark.parametrize(("change", "key", "words"), TEN_FAULTS)
def test_each_fault_alone_is_reported_too(
    butler_copy: Path, change: tuple[str, str], key: str, words: str
) -> None:
    assert words in faults_of(edit(butler_copy, change))[key]


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ((r'^mjcf = "butler.xml"', 'mjcf = "ghost.xml"'), "mjcf", "a file under"),
        ((r'^map = "maps/flat.yaml"', 'map = "maps/ghost.yaml"'), "home.map", "a file under"),
        ((r"velocity = 1.4", "velocity = 14.0"), "limits.left_shoulder_yaw.velocity", "no-load"),
        ((r"offset = 0.2,", "offset = 4.0,"), "limits.left_shoulder_yaw.min", "servo's offset"),
        ((r"max = 1.57, velocity = 1.4", "max = 1.9, velocity = 1.4"), "limits.left_shoulder_yaw",
         "inside the MJCF range"),
        ((r'^joints = \["head_pan", "head_tilt"\]', 'joints = ["head_pan"]'), "groups",
         "each joint in a group"),
        ((r'^grip_site = "left_grip"', 'grip_site = "left_toe"'), "hands.left.grip_site", "a site"),
        ((r'^gripper = "left_gripper"', 'gripper = "left_arm"'), "hands.left.gripper", "one joint"),
        ((r'"charger", ', '"dock", '), "home.places.charging_station.aliases", "not used by"),
        ((r"^\[can_bus\]", "[can_bus_2]"), "can_bus", "a table"),
        ((r"^payload_kg = 0.6", "payload_kg = 0"), "planning.payload_kg", "above 0"),
        ((r"^max_actions = 60", "max_actions = 500"), "planning.max_actions", "in 1..100"),
        ((r"^map_bounds_m = \[-10.0", "map_bounds_m = [20.0"), "planning.map_bounds_m", "least x"),
        ((r'^require_confirmation = "risky"', 'require_confirmation = "no"'),
         "planning.require_confirmation", "never, risky, always"),
        ((r"node_id = 1,", "node_id = 0,"), "can_bus.drives[0].node_id",
         "got 0, expected an integer in 1..126, as cia402 has them"),
        ((r"node_id = 1,", 'node_id = 1, mode = "torque",'), "can_bus.drives[0].mode",
         "got 'torque'"),
        ((r"^bitrate = .*$", 'bitrate = 1000000\neds = "gone.eds"'), "can_bus.eds",
         "got 'gone.eds'"),
        ((r"^bitrate = .*$", 'bitrate = 1000000\nprotocol = "can"'), "can_bus.protocol",
         "got 'can', expected one of cia402, odrive"),
    ],
)  # fmt: skip
def test_contradictions_inside_the_file_are_found(
    butler_copy: Path, change: tuple[str, str], key: str, words: str
) -> None:
    assert words in faults_of(edit(butler_copy, change))[key]


def test_an_mjcf_with_two_root_bodies_is_refused(butler_copy: Path) -> None:
    edit(butler_copy.parent / "butler.xml", ("<worldbody>", '<worldbody><body name="table"/>'))

    assert "exactly one root body" in faults_of(butler_copy)["mjcf"]


def test_a_broken_mjcf_is_a_fault_and_not_a_crash(butler_copy: Path) -> None:
    (butler_copy.parent / "butler.xml").write_text("<mujoco>")

    assert "an MJCF file" in faults_of(butler_copy)["mjcf"]


def test_a_file_that_is_no_toml_is_refused_with_the_place(butler_copy: Path) -> None:
    butler_copy.write_text("name = butler\n")

    assert "line 1" in faults_of(butler_copy)["(file)"]


def test_an_unknown_robot_is_refused_with_the_known_ones() -> None:
    with pytest.raises(RobotFileError, match=r"one of .*butler"):
        load_robot("hal9000")


@pytest.mark.parametrize("value", ["3", '"x"', "[]", "true", "[[1, 2]]", "nan"])
def test_a_value_of_any_wrong_kind_never_crashes_the_loader(butler_copy: Path, value: str) -> None:
    text = butler_copy.read_text()
    keys = re.findall(r"^(\w+) = ", text, flags=re.MULTILINE)
    for key in sorted(set(keys)):
        broken = re.sub(rf"^{key} = (\{{.*\}}|\[\n(.*\n)*?\]|.*)$", f"{key} = {value}", text,
                        count=1, flags=re.MULTILINE)  # fmt: skip
        butler_copy.write_text(broken)
        try:
            load_robot(butler_copy)
        except RobotFileError as error:
            assert error.faults


def test_the_button_and_sound_are_optional(butler_copy: Path) -> None:
    text = butler_copy.read_text()
    for name in ("estop", "microphone", "speaker"):
        text = re.sub(rf"^\[{name}\]\n(?:\w.*\n)+", "", text, flags=re.MULTILINE)
    butler_copy.write_text(text)
    robot = load_robot(butler_copy)

    assert (robot.estop, robot.microphone, robot.speaker) == (None, None, None)
    with pytest.raises(KeyError, match="no device 'estop'"):
        robot.device_path("estop")


def test_faults_of_the_button_and_of_sound_are_told_with_what_is_allowed(
    butler_copy: Path,
) -> None:
    edit(
        butler_copy,
        (r'^model = "HID"', 'model = "ROPE"'),
        (r"^number = 288", "number = 5000"),
        (r"^rate_hz = 16000", "rate_hz = 7"),
        (r'^device = "speaker"', 'device = "microphone"'),
    )
    faults = faults_of(butler_copy)

    assert "one of HID, GPIO" in faults["estop.model"]
    assert "an integer in 0..767" in faults["estop.number"]
    assert "16000" in faults["microphone.rate_hz"]
    assert "not used by microphone.device" in faults["speaker.device"]


def test_a_sensor_without_a_driver_is_told_with_those_there_are(butler_copy: Path) -> None:
    edit(butler_copy, (r'^model = "LD19"', 'model = "LD06"'))

    assert "one of LD19" in faults_of(butler_copy)["lidar.model"]


def test_cia402_in_profile_velocity_needs_no_word() -> None:
    bus = load_robot("butler").can_bus
    assert (bus.protocol, bus.eds_path, bus.endpoints_path) == ("cia402", None, None)
    assert {drive.mode for drive in bus.drives} == {"profile_velocity"}


def test_mode_counts_and_eds_file_are_taken_over(butler_copy: Path) -> None:
    (butler_copy.parent / "mine.eds").write_text("[FileInfo]\n")
    mode = 'mode = "cyclic_synchronous_velocity", counts_per_rev = 4096,'
    edit(
        butler_copy,
        (r"^bitrate = .*$", 'bitrate = 500000\neds = "mine.eds"'),
        (r"node_id = 1,", f"node_id = 1, {mode}"),
    )
    bus = load_robot(butler_copy).can_bus
    assert bus.eds_path == butler_copy.parent / "mine.eds"
    drive = bus.drives[0]
    assert (drive.mode, drive.counts_per_rev) == ("cyclic_synchronous_velocity", 4096)


def test_odrive_needs_its_endpoints_and_its_own_node_ids(butler_copy: Path) -> None:
    edit(
        butler_copy,
        (r"^bitrate = .*$", 'bitrate = 1000000\nprotocol = "odrive"'),
        (r"node_id = 1,", "node_id = 63,"),
    )
    faults = faults_of(butler_copy)
    assert "got nothing, expected the flat_endpoints.json" in faults["can_bus.endpoints"]
    assert "got 63, expected an integer in 0..62" in faults["can_bus.drives[0].node_id"]
