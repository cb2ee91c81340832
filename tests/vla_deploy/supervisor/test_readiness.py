import os

import pytest

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.processes.readiness import Readiness
from vla_deploy.supervisor.table import ProcessSpec

DEADLINE_S = 0.1  # what topics.py declares for base_state


class StepClock:
    time_ns = NS_PER_S

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = deadline_ns


@pytest.fixture
def clock() -> StepClock:
    return StepClock()


@pytest.fixture
def space(tmp_path, clock) -> SharedSpace:
    return SharedSpace(tmp_path / "ipc", clock)


def judge(tmp_path, space, clock, **promise) -> Readiness:
    return Readiness(ProcessSpec(name="a", command=(), **promise), tmp_path, space, clock)


def test_a_topic_counts_while_it_is_young(tmp_path, space, clock):
    readiness = judge(tmp_path, space, clock, ready_topic="base_state")
    assert not readiness.is_ready(os.getpid())
    space.cell_writer("base_state").commit()
    clock.time_ns += round(DEADLINE_S * NS_PER_S)
    assert readiness.is_ready(os.getpid())
    clock.time_ns += 1
    assert not readiness.is_ready(os.getpid())


def test_a_topic_written_by_an_earlier_instance_does_not_count(tmp_path, space, clock):
    space.cell_writer("base_state").commit()
    readiness = judge(tmp_path, space, clock, ready_topic="base_state")
    assert not readiness.is_ready(os.getpid() + 1)


def test_every_promised_file_must_exist(tmp_path, space, clock):
    readiness = judge(tmp_path, space, clock, ready_files=("dev/x", "dev/y"))
    (tmp_path / "dev").mkdir()
    (tmp_path / "dev/x").touch()
    assert not readiness.is_ready(1)
    (tmp_path / "dev/y").touch()
    assert readiness.is_ready(1)


def test_files_of_an_earlier_instance_are_forgotten_even_dangling_links(tmp_path, space, clock):
    readiness = judge(tmp_path, space, clock, ready_files=("x", "y", "z"))
    (tmp_path / "x").touch()
    (tmp_path / "y").symlink_to("/nowhere/pts")
    readiness.forget()
    assert not (tmp_path / "x").exists()
    assert not (tmp_path / "y").is_symlink()
