import errno
import os
import resource
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from platforms import load_profile
from vla_deploy.runtime import host_settings
from vla_deploy.runtime.executors import low_priority_thread
from vla_deploy.runtime.host_settings import HostSettings

NICE = os.getpriority(os.PRIO_PROCESS, os.getpid())


@pytest.fixture
def profile_of(tmp_path):
    asks_nothing = tmp_path / "asks_nothing.toml"
    asks_nothing.write_text(
        'inherits = "desktop"\nrealtime_priority = 0\nrealtime_required = true\n'
        f"processes.control.nice = {NICE}"
    )

    def profile_of(text: str):
        path = tmp_path / "mine.toml"
        path.write_text(f'inherits = "asks_nothing"\n{text}')
        return load_profile(path)

    return profile_of


@pytest.fixture
def powerless(monkeypatch):
    """Take every right away that a profile may need."""
    monkeypatch.setattr(host_settings, "_may", lambda _: False)
    limits = {resource.RLIMIT_RTPRIO: 0, resource.RLIMIT_NICE: 20, resource.RLIMIT_MEMLOCK: 65536}
    monkeypatch.setattr(resource, "getrlimit", lambda which: (limits[which], limits[which]))
    for name in ("sched_setscheduler", "setpriority"):
        monkeypatch.setattr(os, name, _refuse)


def _refuse(*_: object) -> None:
    raise PermissionError(errno.EPERM, "Operation not permitted")


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("realtime_priority = 40", "no SCHED_FIFO priority 40 (grant CAP_SYS_NICE or LimitRTPRIO)"),
        (
            "processes.control.nice = -5",
            f"no nice -5 after {NICE} (grant CAP_SYS_NICE or LimitNICE)",
        ),
        ("memory_lock = true", "no memory lock (grant CAP_IPC_LOCK or LimitMEMLOCK=infinity)"),
        (
            "board.cpu_count = 256\nprocesses.control.affinity = [255]",
            "no CPU [255] (this computer",
        ),
    ],
)
def test_what_the_kernel_refuses_is_told_with_its_remedy(powerless, profile_of, text, refusal):
    host, profile = HostSettings("control"), profile_of(text)
    (obstacle,) = host.obstacles(profile)
    assert obstacle.startswith(refusal)
    assert host.apply(profile) == (obstacle,)


def test_other_threads_of_numeric_libraries_take_another_process(profile_of):
    host, two = HostSettings("control"), profile_of("processes.control.threads = 2")
    assert host.apply(profile_of("")) == ()
    (obstacle,) = host.obstacles(two)
    assert obstacle.startswith("threads = 2: numeric libraries read that once")
    assert obstacle.endswith("they have 1")
    assert host.obstacles(profile_of("")) == HostSettings("control").obstacles(two) == ()


def test_a_priority_that_is_not_required_is_quietly_done_without(powerless, profile_of):
    profile = replace(profile_of("realtime_priority = 40"), realtime_required=False)
    assert HostSettings("control").apply(profile) == ()


def test_a_profile_that_asks_for_nothing_is_never_refused(powerless, profile_of):
    profile = profile_of("")
    assert HostSettings("control").apply(profile) == ()


def test_threads_that_have_put_themselves_aside_keep_their_nice(monkeypatch, profile_of):
    gate = threading.Event()
    sharing = threading.Thread(target=gate.wait, daemon=True)
    sharing.start()
    with low_priority_thread(MonotonicClock()) as executor:
        aside = executor.submit(threading.get_native_id).result()
        asked = {}
        monkeypatch.setattr(os, "setpriority", lambda _, thread, nice: asked.update({thread: nice}))
        HostSettings("control").apply(profile_of(f"processes.control.nice = {NICE + 1}"))
    gate.set()
    sharing.join()
    assert asked[os.getpid()] == asked[sharing.native_id] == NICE + 1
    assert aside not in asked


def test_only_control_asks_for_realtime_and_a_memory_lock(powerless, profile_of):
    profile = profile_of("realtime_priority = 40\nmemory_lock = true")
    assert HostSettings("planner").obstacles(profile) == ()


def test_control_gets_the_profiles_realtime_priority_and_its_other_threads_go_behind(
    monkeypatch, profile_of
):
    asked = {}
    gate = threading.Event()
    writer = threading.Thread(target=gate.wait)
    writer.start()
    monkeypatch.setattr(host_settings, "_may", lambda _: True)
    monkeypatch.setattr(
        os, "sched_setscheduler", lambda thread, *given: asked.__setitem__(thread, given)
    )
    assert HostSettings("control").apply(profile_of("realtime_priority = 40")) == ()
    gate.set()
    assert asked[os.getpid()] == (os.SCHED_FIFO, os.sched_param(40))
    assert asked[writer.native_id] == (os.SCHED_FIFO, os.sched_param(1))


SCRIPT = """
import os, sys, threading
from platforms import load_profile
from vla_deploy.runtime.host_settings import HostSettings

gate = threading.Event()
thread = threading.Thread(target=gate.wait)
thread.start()
host = HostSettings("planner")
for path in sys.argv[1:]:
    print(host.apply(load_profile(path)))
    tids = [0, thread.native_id]
    print([sorted(os.sched_getaffinity(tid)) for tid in tids])
    print([os.getpriority(os.PRIO_PROCESS, tid) for tid in tids])
gate.set()
"""


@pytest.mark.stack
def test_every_thread_of_a_real_process_gets_its_cpus_and_its_nice(tmp_path: Path):
    every = sorted(os.sched_getaffinity(0))
    first = every[0]
    for name, text in {
        "narrow": (
            f"board.cpu_count = 256\nprocesses.planner = {{ affinity = [{first}], nice = 3 }}"
        ),
        "wide": "processes.planner.nice = 7",
    }.items():
        (tmp_path / f"{name}.toml").write_text(f'inherits = "desktop"\n{text}\n')
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path / "narrow.toml"), str(tmp_path / "wide.toml")],
        capture_output=True,
        text=True,
        check=True,
        timeout=30,
    )
    assert done.stdout.splitlines() == [
        "()",
        f"[[{first}], [{first}]]",
        "[3, 3]",
        "()",
        f"[{every}, {every}]",
        "[7, 7]",
    ]
