"""The window: what it shows, when it ends, what is said where there is none, and its mirror."""

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
import pytest

from sim_twin.errors import DrawingFailed
from sim_twin.pictures.drawing import DISPLAY_VARIABLES, start_viewer
from sim_twin.pictures.mirror import MirrorState, mirror_pair, newest_state, send_state
from sim_twin.pictures.viewer_process import show


def state(now_ns: int) -> MirrorState:
    return MirrorState(now_ns=now_ns, clock_ns=7, qpos=np.array([1.0, 2.0]))


def test_only_the_newest_state_arrives() -> None:
    sender, receiver = mirror_pair()
    with sender, receiver:
        send_state(sender, state(1))
        send_state(sender, state(2))
        newest = newest_state(receiver)
        assert newest is not None
        assert (newest.now_ns, newest.clock_ns, newest.qpos.tolist()) == (2, 7, [1.0, 2.0])
        assert newest_state(receiver) is None


def test_a_receiver_that_sleeps_never_holds_up_the_sender() -> None:
    sender, receiver = mirror_pair()
    with sender, receiver:
        for now_ns in range(10_000):
            send_state(sender, state(now_ns))
        assert newest_state(receiver) is not None


def test_the_senders_end_is_noticed() -> None:
    sender, receiver = mirror_pair()
    sender.close()
    with receiver, pytest.raises(EOFError):
        newest_state(receiver)


def test_the_receivers_end_is_noticed() -> None:
    sender, receiver = mirror_pair()
    receiver.close()
    with sender, pytest.raises(BrokenPipeError):
        send_state(sender, state(1))


Mirror = tuple[socket.socket, socket.socket]


@pytest.fixture
def mirror() -> Iterator[Mirror]:
    sender, receiver = mirror_pair()
    yield sender, receiver
    sender.close()
    receiver.close()


@dataclass
class CountingWindow:
    """Close by itself after some pictures, and remember where the arm was in each."""

    data: mujoco.MjData
    pictures: int
    arms_rad: list[float] = field(default_factory=list)

    def is_running(self) -> bool:
        return len(self.arms_rad) < self.pictures

    def sync(self) -> None:
        self.arms_rad.append(float(self.data.joint("arm").qpos[0]))

    def close(self) -> None:
        self.pictures = 0


def send(sender: socket.socket, model: mujoco.MjModel, arm_rad: float) -> None:
    qpos = model.qpos0.copy()
    qpos[model.joint("arm").qposadr[0]] = arm_rad
    send_state(sender, MirrorState(now_ns=10**9, clock_ns=0, qpos=qpos))


def test_the_window_shows_the_newest_state_and_ends_with_the_twin(
    room: mujoco.MjModel, mirror: Mirror
) -> None:
    sender, receiver = mirror
    data = mujoco.MjData(room)
    window = CountingWindow(data, pictures=1)
    for arm_rad in (0.1, 0.2, 0.3):
        send(sender, room, arm_rad)
    show(window, room, data, receiver)
    assert window.arms_rad == [0.3]
    assert data.time == pytest.approx(1.0)
    assert np.any(data.xpos[room.body("arm").id])
    sender.close()
    endless = CountingWindow(data, pictures=10)
    show(endless, room, data, receiver)
    assert endless.arms_rad == []


def test_a_closed_window_ends_at_once(room: mujoco.MjModel, mirror: Mirror) -> None:
    sender, receiver = mirror
    data = mujoco.MjData(room)
    window = CountingWindow(data, pictures=1)
    window.close()
    send(sender, room, 0.1)
    show(window, room, data, receiver)
    assert window.arms_rad == []


def test_without_a_display_the_window_is_refused_before_anything_starts() -> None:
    with pytest.raises(DrawingFailed, match=r"there is no display.*leave --viewer out"):
        start_viewer("butler", "flat", environ={"DISPLAY": ""})


@pytest.mark.stack
def test_the_twin_says_in_one_line_that_there_is_no_display(tmp_path: Path) -> None:
    environ = {name: value for name, value in os.environ.items() if name not in DISPLAY_VARIABLES}
    command = [sys.executable, "-m", "sim_twin", "--viewer", "--run-dir", str(tmp_path)]
    ended = subprocess.run(
        command, env=environ, capture_output=True, text=True, timeout=50, check=False
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("twin: no window: there is no display")
    assert len(ended.stderr.splitlines()) == 1
    assert not (tmp_path / "dev" / "ready").exists()
