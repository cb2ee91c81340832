"""How far a topic has come is told for every kind of topic."""

from collections.abc import Callable
from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.ipc import SharedSpace

PUTS: dict[str, Callable[[SharedSpace], object]] = {
    "base_command": lambda space: space.cell_writer("base_command").put(v_m_s=0.0, w_rad_s=0.0),
    "operator": lambda space: space.ring_writer("operator").publish({}),
    "rgbd": lambda space: space.frame_writer("rgbd").put(b"", width=0, height=0, stamp_ns=5),
    "tick_record": lambda space: space.record_writer("tick_record").append(b"x"),
}


@pytest.mark.parametrize("name", PUTS)
def test_the_pulse_of_a_topic_counts_its_values_and_names_the_last_writer(
    name: str, tmp_path: Path
) -> None:
    space = SharedSpace(tmp_path, MonotonicClock())
    reader = space.pulse_reader(name)
    assert reader.latest() is None
    for count in (1, 2, 3):
        PUTS[name](space)
        pulse = reader.latest()
        assert pulse is not None
        assert pulse.sequence == count
        assert pulse.writer_pid > 1
    space.close()


def test_the_pulse_has_the_stamp_of_the_newest_value(tmp_path: Path) -> None:
    space = SharedSpace(tmp_path, MonotonicClock())
    space.frame_writer("rgbd").put(b"", width=0, height=0, stamp_ns=2_000_000_000)
    pulse = space.pulse_reader("rgbd").latest()
    assert pulse is not None
    assert pulse.age_s(5_000_000_000) == 3.0
    space.close()
