import fcntl
import os
import signal
import tempfile
from pathlib import Path

from vla_deploy.gateways.ros.shared_memory import (
    SHARED_MEMORY,
    find_leftovers,
    remove_leftovers,
)

NODE = """
import os, signal, threading
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String
rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
ended = threading.Event()
signal.signal(signal.SIGTERM, lambda *_: ended.set())
node = Node(f"node_{os.getpid()}")
publisher = node.create_publisher(String, "chatter", 1)
locked = [os.readlink(f"/proc/self/fd/{number}") for number in os.listdir("/proc/self/fd")
          if os.path.exists(f"/proc/self/fd/{number}")]
print(" ".join(one for one in locked if one.endswith(("_el", "_sl"))), flush=True)
while not ended.wait(0.1):
    pass
node.destroy_node()
rclpy.try_shutdown()
"""
DEAD = "fastrtps_0123456789abcdef"
PORT = "fastrtps_port7411"


def lay_out(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).write_bytes(b"x" * 10)
        os.utime(folder / name, (1.0, 1.0))


def test_what_no_process_has_locked_is_left_over_and_is_removed(tmp_path) -> None:
    others = ("fastrtps_port7413", "sem.fastrtps_port7413_mutex", "lttng-ust-wait-6", "vla-run")
    lay_out(tmp_path, DEAD, f"{DEAD}_el", PORT, f"{PORT}_sl", f"sem.{PORT}_mutex", *others)
    found = find_leftovers(tmp_path)
    assert {one.name: one.size_bytes for one in found} == {DEAD: 10, PORT: 20}
    assert remove_leftovers(tmp_path) == found
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(others)
    assert find_leftovers(tmp_path) == ()


def test_what_a_process_has_locked_stays_whether_it_shares_the_lock_or_not(tmp_path) -> None:
    names = (DEAD, f"{DEAD}_el", PORT, f"{PORT}_el", f"{PORT}_sl")
    lay_out(tmp_path, *names)
    with (tmp_path / f"{DEAD}_el").open() as own, (tmp_path / f"{PORT}_sl").open() as shared:
        fcntl.flock(own, fcntl.LOCK_EX)
        fcntl.flock(shared, fcntl.LOCK_SH)
        assert remove_leftovers(tmp_path) == ()
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(names)


def test_a_lock_file_that_is_about_to_be_locked_stays(tmp_path) -> None:
    (tmp_path / DEAD).touch()
    (tmp_path / f"{DEAD}_el").touch()
    assert find_leftovers(tmp_path) == ()
    assert [one.name for one in find_leftovers(tmp_path, young_s=0.0)] == [DEAD]


def test_a_folder_that_is_not_there_holds_none(tmp_path) -> None:
    assert find_leftovers(tmp_path / "absent") == ()


def test_of_real_nodes_the_killed_ones_files_go_and_the_living_ones_stay(ros_graph) -> None:
    killed, living = ros_graph.start(NODE), ros_graph.start(NODE)
    locks = {
        node: [Path(one) for one in node.stdout.readline().split()] for node in ros_graph.started
    }
    assert all(locks.values())
    with tempfile.TemporaryDirectory(dir=SHARED_MEMORY) as name:
        # Second names of the same files, where no other test looks for what is left over.
        folder = Path(name)
        files = {node: [folder / lock.name for lock in held] for node, held in locks.items()}
        for lock in (*locks[killed], *locks[living]):
            for file in (lock, lock.with_name(lock.name[:-3])):
                (folder / file.name).hardlink_to(file)
        assert find_leftovers(folder, young_s=0.0) == ()
        killed.send_signal(signal.SIGKILL)
        killed.wait()

        removed = {lock for one in remove_leftovers(folder, young_s=0.0) for lock in one.locks}
        assert removed == set(files[killed])
        left = {file for lock in files[living] for file in (lock, lock.with_name(lock.name[:-3]))}
        assert set(folder.iterdir()) == left
    for lock in locks[killed]:
        lock.unlink()
        lock.with_name(lock.name[:-3]).unlink()
