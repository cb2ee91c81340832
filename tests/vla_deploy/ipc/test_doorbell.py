import subprocess
import sys
from pathlib import Path

import pytest

from vla_deploy.ipc import SharedSpace, UnknownTopic


def test_a_published_event_wakes_the_listener_once(space, clock):
    bell, writer = space.doorbell("acts"), space.ring_writer("acts")
    assert bell.wait(clock.now_ns()) is False
    writer.publish({})
    writer.publish({})
    assert bell.wait(clock.now_ns() + 10**9) is True
    assert bell.wait(clock.now_ns()) is False


def test_every_listener_is_woken(space, clock):
    bells = [space.doorbell("acts") for _ in range(3)]
    writer = space.ring_writer("acts")
    writer.publish({})
    assert all(bell.wait(clock.now_ns()) for bell in bells)
    assert writer.unheard == 0


def test_an_image_rings_too(space, clock):
    bell = space.doorbell("view")
    space.frame_writer("view").put(b"a", width=1, height=1, stamp_ns=1)
    assert bell.wait(clock.now_ns())


def test_a_listener_that_never_looks_does_not_hold_the_writer_up(space, clock):
    bell, writer = space.doorbell("acts"), space.ring_writer("acts")
    for _ in range(2000):
        writer.publish({})
    assert writer.unheard > 0  # the kernel's queue is shorter than that
    assert bell.wait(clock.now_ns())


def test_a_closed_bell_leaves_nothing_behind(space, tmp_path):
    bell = space.doorbell("acts")
    bell.close()
    bell.close()
    assert list((tmp_path / "ipc/bells/acts").iterdir()) == []


def test_the_socket_of_a_killed_listener_is_removed_by_the_next_ring(space, tmp_path):
    space.doorbell("acts").close()
    folder = tmp_path / "ipc/bells/acts"
    script = (
        "import os, signal, socket, sys; os.chdir(sys.argv[1]);"
        "s = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM); s.bind('dead.0');"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", script, folder], check=False, timeout=20)
    assert [path.name for path in folder.iterdir()] == ["dead.0"]
    writer = space.ring_writer("acts")
    writer.publish({})
    assert (writer.unheard, list(folder.iterdir())) == (1, [])


def test_a_directory_beyond_the_length_of_a_socket_address_works(tmp_path, clock):
    deep = tmp_path / ("d" * 120) / "ipc"
    space = SharedSpace(deep, clock)
    bell = space.doorbell("operator")
    space.ring_writer("operator").publish({"act": "estop"})
    assert bell.wait(clock.now_ns())


def test_a_cell_has_no_bell(space):
    with pytest.raises(UnknownTopic, match="'pair' is a latest-value cell"):
        space.doorbell("pair")


def test_ringing_leaks_no_descriptor(space):
    bell, writer = space.doorbell("acts"), space.ring_writer("acts")
    before = len(list(Path("/proc/self/fd").iterdir()))
    for _ in range(50):
        writer.publish({})
    assert len(list(Path("/proc/self/fd").iterdir())) == before
    bell.close()
