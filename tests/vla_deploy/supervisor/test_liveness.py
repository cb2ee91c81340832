import os

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from platforms import load_profile
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.ipc import SharedSpace
from vla_deploy.supervisor.processes.liveness import WINDOW_S, Liveness, Readiness
from vla_deploy.supervisor.table import TABLE, ProcessSpec, Watched

PID = os.getpid()
PROFILE = load_profile("desktop")
DEADLINE_S = 0.1  # what topics.py declares for base_state


class StepClock(ManualClock):
    def pass_s(self, seconds: float) -> None:
        self.ns += round(seconds * NS_PER_S)


@pytest.fixture
def clock() -> StepClock:
    return StepClock(NS_PER_S)


@pytest.fixture
def space(tmp_path, clock) -> SharedSpace:
    return SharedSpace(tmp_path / "ipc", clock)


def judge(tmp_path, space, clock, **promise) -> Readiness:
    return Readiness(ProcessSpec(name="a", command=(), **promise), tmp_path, space, clock)


def test_a_topic_counts_while_it_is_young(tmp_path, space, clock):
    readiness = judge(tmp_path, space, clock, ready_topic="base_state")
    assert not readiness.is_ready(os.getpid())
    space.cell_writer("base_state").commit()
    clock.ns += round(DEADLINE_S * NS_PER_S)
    assert readiness.is_ready(os.getpid())
    clock.ns += 1
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


def watch(space, clock, *rows: Watched) -> Liveness:
    spec = ProcessSpec(name="a", command=(), watched=rows)
    liveness = Liveness(spec, space, clock, lambda: PROFILE)
    liveness.begin()
    return liveness


def test_a_process_is_silent_when_its_own_last_word_is_too_old(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state", silence_limit_s=2.0))
    space.cell_writer("base_state").commit()
    clock.pass_s(2.0)
    assert liveness.silence(PID) == ""
    clock.pass_s(0.1)
    assert liveness.silence(PID) == "base_state silent for 2.1 s, limit 2 s"


def test_one_that_was_ready_and_never_writes_is_silent_from_then_on(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state", silence_limit_s=2.0))
    clock.pass_s(2.0)
    assert liveness.silence(PID) == ""
    clock.pass_s(0.1)
    assert liveness.silence(PID) != ""


def test_what_an_earlier_instance_has_written_does_not_count(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state", silence_limit_s=2.0))
    for _ in range(30):
        clock.pass_s(0.1)
        space.cell_writer("base_state").commit()
    assert liveness.silence(PID) == ""
    assert liveness.silence(PID + 1) != ""


def test_forgiven_silence_counts_anew(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state", silence_limit_s=2.0))
    clock.pass_s(60.0)
    liveness.begin()
    clock.pass_s(2.0)
    assert liveness.silence(PID) == ""


def test_a_topic_without_a_limit_never_ends_its_process(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state"))
    clock.pass_s(3600.0)
    assert liveness.silence(PID) == ""


def test_an_old_topic_is_an_alarm_with_process_topic_age_and_limit(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state"))
    space.cell_writer("base_state").commit()
    clock.pass_s(0.1)
    assert liveness.examine(PID)[0].alarms == ()
    clock.pass_s(0.05)
    assert liveness.examine(PID)[0].alarms == ("a: base_state: age 0.15 s, limit 0.1 s",)


def beat(space, clock, liveness, rate_hz, seconds, rate_ratio=1.0):
    writer = space.cell_writer("base_state")
    for _ in range(round(seconds * rate_hz)):
        clock.pass_s(1.0 / rate_hz)
        writer.commit()
        vital = liveness.examine(PID, rate_ratio)[0]
    return vital


def test_the_rate_is_judged_by_its_share_of_what_is_declared(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state", rate_ratio=0.5))
    good = beat(space, clock, liveness, 130.0, WINDOW_S + 1)
    assert (round(good.rate_hz), good.alarms) == (130, ())
    bad = beat(space, clock, liveness, 100.0, WINDOW_S + 1)
    assert bad.alarms == ("a: base_state: rate 100.0 Hz, limit 125.0 Hz of 250 Hz declared",)


def test_before_a_window_is_full_no_rate_is_known(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state"))
    vital = beat(space, clock, liveness, 20.0, WINDOW_S - 1)
    assert (vital.rate_hz, vital.alarms) == (None, ())


def test_a_process_told_to_work_slower_is_judged_by_that(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state"))
    assert beat(space, clock, liveness, 40.0, WINDOW_S + 1, rate_ratio=0.25).alarms == ()


def test_the_profiles_rate_overrules_the_topics(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state", profile_rate="perception_rate_hz"))
    rate_hz = PROFILE.perception_rate_hz
    vital = beat(space, clock, liveness, 20 * rate_hz, WINDOW_S + 1)
    assert vital.alarms == ()


def test_a_number_that_is_none_is_an_alarm_that_names_the_field(space, clock):
    liveness = watch(space, clock, Watched(topic="base_state"))
    writer = space.cell_writer("base_state")
    writer.put(x_m=0.0, y_m=np.nan, yaw_rad=0.0, v_m_s=0.0, w_rad_s=0.0, enabled=1)
    assert liveness.examine(PID)[0].alarms == ("a: base_state.y_m: not finite, expected numbers",)


def test_every_process_of_the_robot_is_judged_by_a_topic_that_ends_it_when_silent():
    for spec in TABLE:
        assert any(row.silence_limit_s for row in spec.watched), spec.name
