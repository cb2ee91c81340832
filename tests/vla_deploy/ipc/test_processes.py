"""Kill and freeze real readers and writers."""

import itertools
import os
import random
import signal
import statistics
import subprocess
import sys
import time

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.ipc import Sample, SharedSpace

pytestmark = pytest.mark.stack

PUTS = 3000
NUMBERS = ("x_m", "y_m", "yaw_rad", "match_ratio")
OPEN = """
import sys
from pathlib import Path
from drivers.clock import MonotonicClock
from vla_deploy.ipc import SharedSpace
space = SharedSpace(Path(sys.argv[1]), MonotonicClock())
"""
READ = (
    OPEN
    + """
cell, ring = space.cell_reader("joint_state"), space.ring_reader("operator", from_start=False)
bell, frames = space.doorbell("operator"), space.frame_reader("rgbd")
print("ready", flush=True)
while True:
    cell.latest(), ring.drain(), frames.latest()
"""
)
PUBLISH = (
    OPEN
    + """
ring = space.ring_writer("operator")
print("ready", flush=True)
n = 0
while True:
    n += 1
    ring.publish({"n": n})
"""
)
PUT = (
    OPEN
    + """
cell = space.cell_writer("pose")
print("ready", flush=True)
n = 0
while True:
    n += 1
    cell.put(x_m=n, y_m=n, yaw_rad=n, match_ratio=n, covariance=(n,) * 9, state=0, doubt=0)
"""
)


def _numbers(sample: Sample) -> set[float]:
    """Return every number that the writer put."""
    data = sample.data
    return {*data["covariance"].tolist(), *(float(data[name]) for name in NUMBERS)}


@pytest.fixture
def space(tmp_path) -> SharedSpace:
    return SharedSpace(tmp_path, MonotonicClock())


@pytest.fixture
def spawn(tmp_path):
    children = []

    def start(script: str) -> subprocess.Popen:
        child = subprocess.Popen(
            [sys.executable, "-c", script, str(tmp_path)], stdout=subprocess.PIPE
        )
        children.append(child)
        assert child.stdout.readline() == b"ready\n"
        return child

    yield start
    for child in children:
        child.kill()
        child.wait(timeout=10)
        child.stdout.close()


def median_put_ns(space: SharedSpace) -> float:
    cell, ring = space.cell_writer("joint_state"), space.ring_writer("operator")
    frames, image = space.frame_writer("rgbd"), bytes(640 * 480 * 5)
    times_ns = []
    for n in range(PUTS):
        start_ns = time.monotonic_ns()
        cell.commit()
        ring.publish({"act": "arm", "source": "test", "reason": str(n)})
        if n % 100 == 0:
            frames.put(image, width=640, height=480, stamp_ns=start_ns)
        times_ns.append(time.monotonic_ns() - start_ns)
    return statistics.median(times_ns)


@pytest.mark.parametrize("fate", [signal.SIGSTOP, signal.SIGKILL])
def test_a_frozen_or_killed_reader_does_not_slow_the_writer(space, spawn, fate):
    alone_ns = median_put_ns(space)
    reader = spawn(READ)
    os.kill(reader.pid, fate)
    with_victim_ns = median_put_ns(space)
    assert with_victim_ns < 3 * alone_ns + 50_000
    sample = space.cell_reader("joint_state").latest()
    assert sample.sequence == 2 * PUTS


def test_a_reader_never_sees_a_mix_of_a_writer_at_full_speed(space, spawn):
    spawn(PUT)
    reader = space.cell_reader("pose")
    seen = set()
    start_ns = time.monotonic_ns()
    # On a busy machine a second may hold few turns of both processes.
    while (spent_ns := time.monotonic_ns() - start_ns) < 10**9 or (
        len(seen) <= 100 and spent_ns < 20 * 10**9
    ):
        sample = reader.latest()
        if sample is not None:
            assert _numbers(sample) == {float(sample.sequence)}
            seen.add(sample.sequence)
    assert len(seen) > 100


def test_writers_killed_while_publishing_neither_stall_nor_confuse_the_others(space, spawn):
    chance = random.Random(4)
    reader, writer = space.ring_reader("operator", from_start=False), space.ring_writer("operator")
    sequences = []
    for _ in range(8):
        child = spawn(PUBLISH)
        time.sleep(chance.uniform(0.0, 0.05))
        sequences += [event.sequence for event in reader.drain()]
        child.kill()
        child.wait(timeout=10)
        own = writer.publish({"n": -1})
        events = reader.drain()
        assert (events[-1].sequence, events[-1].payload) == (own, {"n": -1})
        sequences += [event.sequence for event in events]
    assert all(a < b for a, b in itertools.pairwise(sequences))
    assert len(sequences) + reader.lost + reader.torn == sequences[-1]
    assert reader.torn == 0
