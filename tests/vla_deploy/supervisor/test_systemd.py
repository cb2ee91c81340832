"""What systemd gets to know: the status line, the notify protocol, the times of the unit."""

import os
import socket
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.supervisor.health import STATUS_AGE_S
from vla_deploy.supervisor.processes.lifecycle import ProcessRecord, ProcessState
from vla_deploy.supervisor.systemd import (
    FEED_EVERY_NS,
    RESTART_S,
    START_BURST,
    Notifier,
    NotifySocket,
    NotifyTarget,
    give_up_s,
    hide_from_children,
    longest_start_s,
    notify_target,
    start_limit_s,
    status_line,
    trouble_in,
    watchdog_s,
    with_late,
)
from vla_deploy.supervisor.table import TABLE, GivingUp, ProcessSpec, Watched

READY = ProcessRecord(state=ProcessState.READY)


@pytest.mark.parametrize(
    "state", [ProcessState.BACKOFF, ProcessState.GIVEN_UP, ProcessState.ABORTING]
)
def test_a_process_that_fails_is_trouble(state: ProcessState) -> None:
    failing = ProcessRecord(state=state, reason="exit code 1")
    status = status_line({"control": READY, "planner": failing}, stopping=False)
    assert status == f"degraded: planner {state.value} (exit code 1)"
    assert trouble_in(status) == status


def test_what_is_late_is_trouble() -> None:
    status = with_late("all 9 processes ready", ["bus arm: lost 3", "supervisor: held up"])
    assert trouble_in(status) == status == "all 9 processes ready; not in time: bus arm: lost 3"


@pytest.mark.parametrize(
    ("state", "status"),
    [
        (ProcessState.READY, "all 2 processes ready"),
        (ProcessState.STARTING, "starting planner: 1 of 2 ready"),
        (ProcessState.OFF, "all 1 processes ready"),
    ],
)
def test_what_starts_or_is_off_is_no_trouble_nor_is_another_profile(
    state: ProcessState, status: str
) -> None:
    records = {"control": READY, "planner": ProcessRecord(state=state)}
    told = status_line(records, stopping=False, fault="the chosen profile x does not load")
    assert told == f"{status}; the chosen profile x does not load"
    assert trouble_in(with_late(told, [])) == ""


WATCHDOG_NS = 10 * NS_PER_S


class StepClock(ManualClock):
    def pass_s(self, seconds: float) -> None:
        self.ns += round(seconds * NS_PER_S)


class Systemd:
    """Listen where systemd would."""

    def __init__(self, address: str) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(address)
        self.socket.setblocking(False)

    def heard(self) -> list[str]:
        messages = []
        while True:
            try:
                messages.append(self.socket.recv(4096).decode())
            except BlockingIOError:
                return messages


@pytest.fixture
def address(tmp_path: Path) -> str:
    return str(tmp_path / "notify")


@pytest.fixture
def systemd(address: str) -> Iterator[Systemd]:
    listening = Systemd(address)
    yield listening
    listening.socket.close()


@pytest.fixture
def clock() -> StepClock:
    return StepClock(100 * NS_PER_S)


@pytest.fixture
def notifier(systemd: Systemd, address: str, clock: StepClock) -> Iterator[Notifier]:
    made = Notifier(NotifyTarget(address=address, watchdog_ns=WATCHDOG_NS), clock)
    yield made
    made.close()


def step(notifier: Notifier, *troubles: str, ready: bool = True, stopping: bool = False) -> None:
    notifier.step(ready=ready, stopping=stopping, status="fine", troubles=troubles)


def test_the_target_is_what_systemd_has_set_for_this_process():
    environment = {"NOTIFY_SOCKET": "/run/n", "WATCHDOG_USEC": "5000000", "WATCHDOG_PID": "7"}
    assert notify_target(environment, 7) == NotifyTarget(address="/run/n", watchdog_ns=5 * NS_PER_S)


def test_a_watchdog_meant_for_another_process_is_not_fed():
    environment = {"NOTIFY_SOCKET": "/run/n", "WATCHDOG_USEC": "5000000", "WATCHDOG_PID": "7"}
    assert notify_target(environment, 8).watchdog_ns == 0


def test_a_watchdog_without_a_pid_is_for_whoever_reads_it():
    assert notify_target({"WATCHDOG_USEC": "1000"}, 8).watchdog_ns == 1_000_000


def test_without_systemd_there_is_no_target():
    assert notify_target({}, 1) == NotifyTarget()


def test_children_do_not_learn_of_systemd():
    environment = dict.fromkeys(("NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID", "HOME"), "x")
    hide_from_children(environment)
    assert environment == {"HOME": "x"}


def test_an_address_with_an_at_sign_is_in_the_abstract_namespace():
    name = f"vla-test-{os.getpid()}"
    listening = Systemd(f"\0{name}")
    sender = NotifySocket(f"@{name}")
    assert sender.send(READY="1")
    assert listening.heard() == ["READY=1"]
    sender.close()
    listening.socket.close()


def test_several_assignments_are_lines_of_one_datagram_and_values_stay_in_theirs(systemd, address):
    sender = NotifySocket(address)
    sender.send(STATUS="two\nlines", MAINPID="1")
    assert systemd.heard() == ["STATUS=two lines\nMAINPID=1"]
    sender.close()


def test_nobody_listening_is_counted_and_raises_nothing(tmp_path):
    sender = NotifySocket(str(tmp_path / "nobody"))
    assert not sender.send(READY="1")
    assert sender.refused == 1
    sender.close()


def test_a_full_socket_does_not_hold_the_caller_up(systemd, address):
    sender = NotifySocket(address)
    while sender.send(STATUS="x" * 1000):
        pass
    assert sender.refused == 1
    sender.close()


def test_without_an_address_nothing_is_sent(clock):
    notifier = Notifier(NotifyTarget(), clock)
    step(notifier)
    notifier.stopping()
    notifier.close()


def test_ready_is_told_once_when_everything_is_ready(systemd, notifier, clock):
    step(notifier, ready=False)
    assert "READY=1" not in systemd.heard()
    step(notifier)
    assert "READY=1" in systemd.heard()
    clock.pass_s(30)
    step(notifier)
    assert "READY=1" not in systemd.heard()


def test_the_status_is_told_when_it_changes_and_at_most_once_a_second(systemd, notifier, clock):
    step(notifier)
    assert "STATUS=fine" in systemd.heard()
    step(notifier, "bus lost")
    assert not [text for text in systemd.heard() if text.startswith("STATUS")]
    clock.pass_s(1)
    step(notifier, "bus lost")
    assert "STATUS=fine; not in time: bus lost" in systemd.heard()


def test_whoever_waits_until_it_is_ready_reads_a_status_of_now(systemd, notifier, clock):
    notifier.step(ready=False, stopping=False, status="degraded: a back-off", troubles=())
    systemd.heard()
    clock.pass_s(0.05)
    step(notifier)
    heard = systemd.heard()
    assert heard.index("STATUS=fine") < heard.index("READY=1")


def test_a_long_start_asks_for_time_every_five_seconds(systemd, notifier, clock):
    asked = 0
    for _ in range(40):  # 20 s
        step(notifier, "control: has not told its status yet", ready=False)
        asked += systemd.heard().count("EXTEND_TIMEOUT_USEC=15000000")
        clock.pass_s(0.5)
    assert asked == 4
    step(notifier)
    assert "EXTEND_TIMEOUT_USEC=15000000" not in systemd.heard()


def test_a_stop_is_told_and_asks_for_time(systemd, notifier, clock):
    step(notifier)
    systemd.heard()
    notifier.stopping()
    clock.pass_s(5)
    step(notifier, "control: age", stopping=True, ready=False)
    heard = systemd.heard()
    assert heard[0] == "STOPPING=1"
    assert "EXTEND_TIMEOUT_USEC=15000000" in heard
    assert "READY=1" not in heard


@pytest.mark.parametrize(("watchdog_s", "every_s"), [(10.0, 1.0), (1.0, 0.5)])
def test_the_watchdog_is_fed_every_second_or_at_half_its_interval(
    systemd, address, clock, watchdog_s, every_s
):
    target = NotifyTarget(address=address, watchdog_ns=round(watchdog_s * NS_PER_S))
    notifier = Notifier(target, clock)
    fed_at_s = []
    start_ns = clock.ns
    for _ in range(80):  # 4 s in steps of 50 ms
        step(notifier)
        if "WATCHDOG=1" in systemd.heard():
            fed_at_s.append((clock.ns - start_ns) / NS_PER_S)
        clock.pass_s(0.05)
    assert fed_at_s == pytest.approx([every_s * feed for feed in range(round(4.0 / every_s))])
    notifier.close()


def test_in_trouble_the_watchdog_is_not_fed_and_afterwards_at_once(systemd, notifier, clock):
    step(notifier)
    systemd.heard()
    for _ in range(400):
        clock.pass_s(0.05)
        step(notifier, "control: tick rate 10 Hz, limit 125 Hz")
        assert "WATCHDOG=1" not in systemd.heard()
    step(notifier)
    assert "WATCHDOG=1" in systemd.heard()


def test_a_stop_goes_on_feeding_since_control_ends_before_the_run_does(systemd, notifier, clock):
    step(notifier)
    clock.pass_s(5)
    systemd.heard()
    step(notifier, "control: age", stopping=True, ready=False)
    assert "WATCHDOG=1" in systemd.heard()


def test_without_a_watchdog_nothing_is_fed(systemd, address, clock):
    notifier = Notifier(NotifyTarget(address=address), clock)
    step(notifier)
    assert "WATCHDOG=1" not in systemd.heard()
    notifier.close()


CONTROL = next(row for row in TABLE if row.name == "control")


def test_the_watchdog_waits_until_a_hanging_control_is_up_again():
    assert watchdog_s() == 15  # 5 s silent, 1 s to tell where, 0.25 s, 8 s to start


def test_feeding_costs_the_watchdog_no_more_than_an_ageing_status_gives_it():
    assert STATUS_AGE_S >= FEED_EVERY_NS / 1e9


@pytest.mark.parametrize("longer_s", [1.0, 20.0])
def test_the_watchdog_follows_the_row(longer_s):
    watched = (Watched(topic="control_status", silence_limit_s=5.0 + longer_s),)
    assert watchdog_s([replace(CONTROL, watched=watched)]) == 15 + longer_s


def test_the_longest_start_waits_for_the_rows_before_and_for_none_beside():
    rows = (
        ProcessSpec(name="a", command=(), ready_timeout_s=7.0),
        ProcessSpec(name="b", command=(), ready_timeout_s=900.0, with_previous=True),
        ProcessSpec(name="c", command=(), ready_timeout_s=20.0),
        ProcessSpec(name="d", command=(), giving_up=GivingUp.CARRY_ON, ready_timeout_s=9999.0),
    )
    assert longest_start_s(rows[:1]) == give_up_s(rows[0])
    assert longest_start_s((rows[0], rows[2])) == 7.0 + give_up_s(rows[2])
    assert longest_start_s((rows[0], rows[3])) == give_up_s(rows[0])
    assert longest_start_s(rows[:2]) == give_up_s(rows[1])


def test_starts_that_fail_as_slowly_as_can_be_still_end_the_service():
    once_s = longest_start_s() + sum(row.stop_timeout_s for row in TABLE) + RESTART_S
    assert START_BURST * once_s <= start_limit_s() < START_BURST * once_s + 60
