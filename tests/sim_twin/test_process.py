import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import can
import numpy as np
import pytest

from drivers.audio.base import AudioFormat
from drivers.audio.pcm_stream import PcmInput, PcmOutput
from drivers.camera.rgbd_stream import RgbdCamera
from drivers.clock import MonotonicClock
from drivers.dynamixel.wire.codec import Instruction, encode_instruction
from drivers.estop.open_estop import open_estop
from drivers.opener import PathOpener
from platforms.probes.battery import CHARGE, PowerSupplySource
from platforms.tree import Tree
from sim_twin.errors import RefereeRefusal, TwinUnreachable
from sim_twin.referee import ask
from sim_twin.sound.talk import said, talk
from vla_deploy.robots import load_robot
from vla_deploy.robots.links import device_links
from vla_deploy.robots.loader import ROBOTS_DIR

START_TIMEOUT_S = 30.0
END_TIMEOUT_S = 15.0
PARENT_PID = ("--parent-pid", str(os.getpid()))
PARENT = """
import os, subprocess, sys
parent = ["--parent-pid", str(os.getpid())]
subprocess.run([sys.executable, "-m", "sim_twin", *parent, *sys.argv[1:]])
"""

pytestmark = pytest.mark.stack


def await_that(what: str, holds: object, timeout_s: float) -> None:
    deadline_s = time.monotonic() + timeout_s
    while not holds():  # type: ignore[operator]
        assert time.monotonic() < deadline_s, f"{what}: not within {timeout_s} s"
        time.sleep(0.02)


def start(run_dir: Path, *arguments: str) -> subprocess.Popen[bytes]:
    twin = subprocess.Popen(
        [sys.executable, "-m", "sim_twin", "--run-dir", str(run_dir), *PARENT_PID, *arguments],
        stderr=subprocess.PIPE,
    )
    ready = run_dir / "dev" / "ready"
    await_that("twin ready", lambda: ready.exists() or twin.poll() is not None, START_TIMEOUT_S)
    assert twin.poll() is None
    return twin


def end(twin: subprocess.Popen[bytes]) -> int:
    twin.terminate()
    code = twin.wait(END_TIMEOUT_S)
    assert twin.stderr is not None
    twin.stderr.close()
    return code


def butler_with_camera(folder: Path, *, site: str, camera: str) -> Path:
    """Make a butler whose camera's site and MuJoCo camera have other names."""
    shutil.copytree(ROBOTS_DIR / "butler", folder)
    mjcf, robot_file = folder / "butler.xml", folder / "robot.toml"
    drawn = mjcf.read_text().replace('<site name="head_camera"', f'<site name="{site}"')
    mjcf.write_text(drawn.replace('<camera name="head_camera"', f'<camera name="{camera}"'))
    robot_file.write_text(
        robot_file.read_text().replace('site = "head_camera"', f'site = "{site}"')
    )
    return folder


def children(pid: int) -> list[int]:
    tasks = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    return [int(word) for word in tasks.split()]


def is_running(pid: int) -> bool:
    """Return whether a process still runs; a zombie that was not reaped does not."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return False
    return stat.rpartition(")")[2].split()[0] not in "ZX"


@pytest.fixture(scope="module")
def run_dir(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    run_dir = tmp_path_factory.mktemp("twin")
    twin = start(run_dir, "--no-camera")
    yield run_dir
    end(twin)


@pytest.fixture
def devices(run_dir: Path) -> PathOpener:
    return PathOpener(device_links(load_robot("butler"), run_dir / "dev"), MonotonicClock())


def test_servos_answer_a_ping_between_two_steps(devices: PathOpener) -> None:
    clock = MonotonicClock()
    line = devices.serial("servos")
    waits_ns = []
    for _ in range(50):
        line.discard_input()
        asked_ns = clock.now_ns()
        line.write(encode_instruction(1, Instruction.PING))
        reply = line.read(64, asked_ns + 1_000_000_000)
        waits_ns.append(clock.now_ns() - asked_ns)
        assert reply[:5] == b"\xff\xff\xfd\x00\x01"
    line.close()
    assert statistics.median(waits_ns) < 4_000_000


def test_paced_servos_take_their_return_delay_and_their_bytes(tmp_path: Path) -> None:
    twin = start(tmp_path, "--no-camera", "--paced")
    robot = load_robot("butler")
    clock = MonotonicClock()
    line = PathOpener(device_links(robot, tmp_path / "dev"), clock).serial("servos")
    waits_ns = []
    for _ in range(20):
        asked_ns = clock.now_ns()
        line.write(encode_instruction(1, Instruction.PING))
        assert len(line.read(64, asked_ns + 1_000_000_000)) == 14
        waits_ns.append(clock.now_ns() - asked_ns)
    line.close()
    assert min(waits_ns) > 500_000 + (10 + 14) * 10 * 1_000_000_000 / robot.servo_bus.baud
    end(twin)


def test_drives_send_heartbeats_and_answer(devices: PathOpener) -> None:
    bus = devices.can("can")
    bus.send(can.Message(arbitration_id=0x602, data=bytes(8), is_extended_id=False))
    answer = bus.recv(timeout=2.0)
    bus.shutdown()
    assert answer is not None
    assert answer.arbitration_id == 0x582


def test_paced_frames_take_the_time_of_their_bits(tmp_path: Path) -> None:
    twin = start(tmp_path, "--no-camera", "--paced")
    exchanges, bits_at_least, step_s = 60, 108, 0.002
    links = device_links(load_robot("butler"), tmp_path / "dev")
    bus = PathOpener(links, MonotonicClock()).can("can")
    asked_s = ask(tmp_path, "truth")["sim_s"]
    for _ in range(exchanges):
        bus.send(can.Message(arbitration_id=0x602, data=bytes(8), is_extended_id=False))
        while (frame := bus.recv(timeout=2.0)) is not None and frame.arbitration_id != 0x582:
            pass
        assert frame is not None
    # In simulated time: on the wall clock a twin that is behind may catch up some milliseconds.
    took_s = ask(tmp_path, "truth")["sim_s"] - asked_s
    bus.shutdown()
    end(twin)
    assert took_s + step_s > 2 * exchanges * bits_at_least * 1e-6


@pytest.mark.parametrize(("name", "header"), [("lidar", b"\x54\x2c"), ("imu", b"\xaa\xaa")])
def test_sensors_send_unasked(devices: PathOpener, name: str, header: bytes) -> None:
    line = devices.serial(name)
    line.discard_input()
    heard = b""
    while len(heard) < 200:
        heard += line.read(1000, MonotonicClock().now_ns() + 2_000_000_000)
    line.close()
    assert header in heard


def test_the_batterys_gauge_is_a_folder_among_the_devices(run_dir: Path) -> None:
    source = PowerSupplySource(Tree(run_dir / "dev"))

    def charge() -> float | None:
        return next(one.value for one in source.readings() if one.name == CHARGE)

    await_that("the gauge", lambda: charge() is not None, START_TIMEOUT_S)
    assert charge() == pytest.approx(0.8, abs=0.05)


def test_the_referee_reports_the_truth_and_the_pace(run_dir: Path) -> None:
    first = ask(run_dir, "truth")
    second = ask(run_dir, "truth")
    assert second["sim_s"] >= first["sim_s"]
    assert second["real_time_factor"] <= 1.2
    assert not ask(run_dir, "inside", object="red_cup", container="box")["inside"]


def test_the_referee_refuses_with_a_reason(run_dir: Path) -> None:
    with pytest.raises(RefereeRefusal, match="'spoon'"):
        ask(run_dir, "inside", object="spoon", container="box")
    with pytest.raises(RefereeRefusal, match="'explode'"):
        ask(run_dir, "explode")


def test_the_referees_command_line_prints_json(run_dir: Path) -> None:
    command = [sys.executable, "-m", "sim_twin.referee", "--run-dir", str(run_dir)]
    answer = subprocess.run([*command, "truth"], capture_output=True, check=True)
    assert "red_cup" in json.loads(answer.stdout)["objects"]
    refused = subprocess.run(
        [*command, "inside", "--object", "cup"], capture_output=True, text=True, check=False
    )
    assert (refused.returncode, refused.stderr) == (2, "referee: inside needs --container\n")


def test_without_a_twin_the_referee_is_unreachable(tmp_path: Path) -> None:
    with pytest.raises(TwinUnreachable, match="No such file"):
        ask(tmp_path, "truth")


@pytest.mark.gl
def test_camera_and_film_are_served_and_sigterm_leaves_nothing(tmp_path: Path) -> None:
    twin = start(tmp_path, "--seed", "3")
    (studio,) = children(twin.pid)
    clock = MonotonicClock()
    opener = PathOpener(device_links(load_robot("butler"), tmp_path / "dev"), clock)
    camera = RgbdCamera(opener.stream("camera"), clock)
    ask(tmp_path, "film_start", path=str(tmp_path / "film.avi"))
    ask(tmp_path, "caption", text="look")
    camera.start(10.0)
    await_that("frame", lambda: camera.poll() is not None, 10.0)
    camera.close()
    await_that("film", lambda: ask(tmp_path, "truth")["sim_s"] > 3.0, 60.0)
    assert ask(tmp_path, "film_stop")["frames"] > 1
    assert end(twin) == 0
    assert not is_running(studio)
    assert list((tmp_path / "dev").iterdir()) == []
    assert (tmp_path / "film.png").exists()


@pytest.mark.gl
def test_a_robot_whose_camera_has_another_name_is_filmed_too(tmp_path: Path) -> None:
    robot = butler_with_camera(tmp_path / "robot", site="chest_eye", camera="chest_eye")
    run_dir = tmp_path / "run"
    run_dir.mkdir()
    twin = start(run_dir, "--robot", str(robot), "--pace", "real")
    ask(run_dir, "film_start", path=str(tmp_path / "film.avi"))
    await_that("film", lambda: ask(run_dir, "truth")["sim_s"] > 1.0, 20.0)
    assert ask(run_dir, "film_stop")["frames"] > 1
    assert end(twin) == 0


@pytest.mark.parametrize(
    ("run_dir", "words", "reason"),
    [
        ("", ["--world", "moon"], "'moon'.*flat"),
        ("long" * 20, [], "choose a shorter one"),
        ("", ["--robot", "{robot}"], 'expected a <camera name="chest_eye">.*head_camera'),
    ],
    ids=["unknown world", "path too long for sockets", "camera that the MJCF lacks"],
)
def test_what_cannot_be_started_is_refused_in_one_line(
    tmp_path: Path, run_dir: str, words: list[str], reason: str
) -> None:
    robot = butler_with_camera(tmp_path / "robot", site="chest_eye", camera="head_camera")
    folder = tmp_path / run_dir
    folder.mkdir(exist_ok=True)
    words = [word.replace("{robot}", str(robot)) for word in words]
    refused = subprocess.run(
        [sys.executable, "-m", "sim_twin", "--run-dir", str(folder), *words],
        capture_output=True,
        text=True,
        timeout=START_TIMEOUT_S,
        check=False,
    )
    assert refused.returncode == 2
    (line,) = refused.stderr.splitlines()
    assert re.search(reason, line)


@pytest.mark.gl
def test_the_twin_and_its_camera_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    parent = subprocess.Popen([sys.executable, "-c", PARENT, "--run-dir", str(tmp_path)])
    await_that("ready", (tmp_path / "dev" / "ready").exists, START_TIMEOUT_S)
    (twin,) = children(parent.pid)
    (studio,) = children(twin)
    os.kill(parent.pid, signal.SIGKILL)
    parent.wait(END_TIMEOUT_S)
    await_that("all ended", lambda: not is_running(twin) and not is_running(studio), END_TIMEOUT_S)
    assert not (tmp_path / "dev" / "ready").exists()


def test_a_twin_in_the_background_outlives_the_shell_that_started_it(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "sim_twin", "--no-camera", "--run-dir", str(tmp_path)]
    ready = tmp_path / "dev" / "ready"
    with subprocess.Popen(
        ["sh", "-c", '"$@" >/dev/null 2>&1 & echo $!; read -r _', "sh", *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as shell:
        assert shell.stdout is not None
        twin = int(shell.stdout.readline())
        await_that("ready", ready.exists, START_TIMEOUT_S)
        shell.communicate("\n", END_TIMEOUT_S)
    try:
        # A signal at the shell's end would have reached it before it steps on.
        before_s = ask(tmp_path, "truth")["sim_s"]
        await_that("on", lambda: ask(tmp_path, "truth")["sim_s"] > before_s, END_TIMEOUT_S)
        assert is_running(twin)
    finally:
        if is_running(twin):
            os.kill(twin, signal.SIGTERM)
    await_that("ended", lambda: not is_running(twin), END_TIMEOUT_S)
    assert not ready.exists()


def test_the_button_and_the_room_are_served(devices: PathOpener) -> None:
    clock = MonotonicClock()
    robot = load_robot("butler")
    assert robot.estop is not None
    assert robot.microphone is not None
    ear = robot.microphone
    button = open_estop("HID", devices, robot.estop.device, clock, number=robot.estop.number)
    sound = AudioFormat(rate_hz=ear.rate_hz, channels=ear.channels)
    microphone = PcmInput(devices.stream(ear.device), clock, sound)
    await_that("button released", lambda: not button.poll().pressed, 5.0)
    await_that("sound", lambda: microphone.poll() is not None, 5.0)
    button.close()
    again = open_estop("HID", devices, robot.estop.device, clock, number=robot.estop.number)
    await_that("button released", lambda: not again.poll().pressed, 5.0)
    again.close()
    microphone.close()


def test_speech_reaches_the_microphone_and_the_speaker_is_recorded(run_dir: Path) -> None:
    clock = MonotonicClock()
    opener = PathOpener(device_links(load_robot("butler"), run_dir / "dev"), clock)
    format_ = AudioFormat(rate_hz=16_000)
    ear = PcmInput(opener.stream("microphone"), clock, format_)
    mouth = PcmOutput(opener.stream("speaker"), clock, format_)
    spoken = talk(run_dir, "stop", "en-us", snr_db=20.0)
    assert 0 < spoken["ended_ns"] - spoken["began_ns"] < 2_000_000_000
    words = np.arange(1_000, dtype=np.int16)[:, None]
    assert mouth.write(words) == 1_000
    loudest: dict[bool, int] = {False: 0, True: 0}
    while clock.now_ns() < spoken["ended_ns"] + 100_000_000:
        clock.sleep_until(clock.now_ns() + 20_000_000)
        if (block := ear.poll()) is not None:
            inside = spoken["began_ns"] <= block.stamp_ns <= spoken["ended_ns"]
            loudest[inside] = max(loudest[inside], int(np.abs(block.samples).max()))
    assert loudest[True] > 3 * loudest[False] > 0
    ear.close()
    mouth.close()
    assert np.array_equal(said(run_dir), words)
    with pytest.raises(RefereeRefusal, match="beside the devices"):
        ask(run_dir, "sound_play", name="../robot.wav")
    with pytest.raises(RefereeRefusal, match="no such file"):
        ask(run_dir, "sound_play", name="none.wav")
