import fcntl
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from vla_deploy.supervisor.errors import AlreadyRunning, RuntimeUnavailable
from vla_deploy.supervisor.runs.runtime import (
    Owner,
    Runtime,
    default_base,
    old_logs,
    own_start_ticks,
    running,
)


@pytest.fixture
def shared(tmp_path):
    directory = tmp_path / "shm"
    directory.mkdir()
    return directory


def test_a_run_has_a_private_directory_and_a_link_to_it(tmp_path, shared):
    base = tmp_path / "base"
    runtime = Runtime(base, shared)
    assert base.stat().st_mode & 0o777 == 0o700
    assert runtime.run_dir == base / runtime.run_id
    assert (base / "current").resolve() == runtime.run_dir
    assert (runtime.run_dir / "ipc").resolve().parent == shared
    assert (runtime.run_dir / "ipc").stat().st_mode & 0o777 == 0o700
    runtime.close()
    assert [path.name for path in base.iterdir()] == ["lock"]
    assert list(shared.iterdir()) == []


def test_without_shared_memory_the_run_directory_holds_the_topics(tmp_path):
    runtime = Runtime(tmp_path / "base", tmp_path / "no-shm")
    assert runtime.ipc_dir == runtime.run_dir / "ipc"
    assert runtime.ipc_dir.is_dir()
    runtime.close()


def test_the_holder_is_told_while_it_runs(tmp_path, shared):
    base = tmp_path / "base"
    assert running(base) is None
    runtime = Runtime(base, shared)
    owner = running(base)
    assert (owner.pid, owner.run_id, owner.run_dir) == (
        os.getpid(),
        runtime.run_id,
        str(runtime.run_dir),
    )
    runtime.close()
    assert running(base) is None


def test_a_second_one_is_refused_until_the_first_has_closed(tmp_path, shared):
    first = Runtime(tmp_path / "base", shared)
    with pytest.raises(AlreadyRunning, match=rf"pid {os.getpid()}, run {first.run_id}"):
        Runtime(tmp_path / "base", shared)
    assert first.run_dir.is_dir()
    first.close()
    Runtime(tmp_path / "base", shared).close()


def test_a_holder_that_has_not_yet_said_who_it_is_is_still_respected(tmp_path, shared):
    base = tmp_path / "base"
    base.mkdir()
    with (base / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(AlreadyRunning, match="just starting or stopping"):
            Runtime(base, shared)


def test_folders_that_are_no_runs_are_left_alone(tmp_path, shared):
    (tmp_path / "photos" / "logs").mkdir(parents=True)
    (tmp_path / "20260101-old").mkdir()
    Runtime(tmp_path, shared).close()
    assert (tmp_path / "photos" / "logs").is_dir()
    assert (tmp_path / "20260101-old").is_dir()


def test_a_directory_that_everybody_may_write_to_is_refused(tmp_path, shared):
    base = tmp_path / "base"
    base.mkdir()
    base.chmod(0o1777)
    with pytest.raises(RuntimeUnavailable, match=r"everybody may write to it.*chmod o-w"):
        Runtime(base, shared)


def test_runs_and_shared_memory_of_dead_supervisors_are_swept(tmp_path, shared):
    base = tmp_path / "base"
    (base / "20260101-000000-1" / "logs").mkdir(parents=True)
    (base / "current").symlink_to("20260101-000000-1")
    dead = shared / f"vla-deploy-{os.getuid()}-20260101-000000-1"
    dead.mkdir()
    owner = {"pid": os.getpid(), "started": 1.0, "run_id": "x", "run_dir": "y"}
    (dead / "owner.json").write_text(json.dumps(owner))  # this pid, but another start
    runtime = Runtime(base, shared)
    assert {path.name for path in base.iterdir()} == {"lock", "current", runtime.run_id}
    assert list(shared.iterdir()) == [runtime.ipc_dir]
    runtime.close()


def test_the_shared_memory_of_a_living_supervisor_elsewhere_is_left_alone(tmp_path, shared):
    script = (
        "import sys; from pathlib import Path;"
        "from vla_deploy.supervisor.runs.runtime import Runtime;"
        "runtime = Runtime(Path(sys.argv[1]), Path(sys.argv[2]));"
        "print(runtime.ipc_dir, flush=True); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", script, str(tmp_path / "other"), str(shared)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with other:
        theirs = Path(other.stdout.readline().strip())
        Runtime(tmp_path / "base", shared).close()
        assert theirs.is_dir()
        other.stdin.close()
    Runtime(tmp_path / "base", shared).close()
    assert not theirs.exists()


def test_a_base_that_cannot_be_made_is_named(tmp_path, shared):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(RuntimeUnavailable, match=r"file/base: Not a directory; .*--runtime-base"):
        Runtime(tmp_path / "file" / "base", shared)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give a directory away")
def test_a_base_of_another_user_is_refused(tmp_path, shared):
    base = tmp_path / "base"
    base.mkdir()
    os.chown(base, 12345, 12345)
    with pytest.raises(RuntimeUnavailable, match=r"belongs to user 12345, expected 0"):
        Runtime(base, shared)


@pytest.mark.parametrize(
    ("uid", "variable", "expected"),
    [
        (0, "/run/user/0", "/run/vla-deploy"),
        (1000, "/run/user/1000", "/run/user/1000/vla-deploy"),
        (1000, None, "/tmp/vla-deploy-1000"),
    ],
)
def test_runs_live_where_the_user_may_write(monkeypatch, uid, variable, expected):
    monkeypatch.setattr(os, "getuid", lambda: uid)
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    if variable:
        monkeypatch.setenv("XDG_RUNTIME_DIR", variable)
    assert default_base() == Path(expected)


def test_an_owner_is_told_from_a_later_process_of_its_pid_by_ticks_since_boot(tmp_path):
    ticks = own_start_ticks()
    mine = Owner(pid=os.getpid(), start_ticks=ticks, run_id="run", run_dir=str(tmp_path))
    assert mine.is_alive()
    assert not replace(mine, start_ticks=ticks + 1).is_alive()
    assert not replace(mine, pid=2**22 + 1).is_alive()


def test_the_logs_of_a_dead_run_are_kept_by_the_next_start(tmp_path, shared):
    base = tmp_path / "base"
    logs = base / "20260101-000000-1" / "logs"
    logs.mkdir(parents=True)
    (logs / "control.log").write_text("{}\n")
    Runtime(base, shared).close()
    (kept,) = old_logs(tmp_path / "base-state").entries()
    assert kept.name == "000001-20260101-000000-1"
    assert (kept / "control.log").read_text() == "{}\n"


def test_logs_that_cannot_be_kept_are_told_and_hold_nobody_up(tmp_path, shared, caplog):
    (tmp_path / "base-state").write_text("no folder")
    runtime = Runtime(tmp_path / "base", shared)
    (runtime.run_dir / "logs").mkdir()
    runtime.close()
    assert f"the logs of run {runtime.run_id} are lost" in caplog.text
    assert not runtime.run_dir.exists()


@pytest.mark.parametrize("suffix", ["state", "config"])
@pytest.mark.parametrize(
    ("owner", "mode", "complaint"),
    [(4711, 0o700, "belongs to user 4711"), (None, 0o777, "everybody may write to it")],
)
def test_folders_that_another_user_has_prepared_are_refused(
    tmp_path, shared, suffix, owner, mode, complaint
):
    prepared = tmp_path / f"base-{suffix}"
    prepared.mkdir()
    prepared.chmod(mode)
    if owner is not None:
        if os.getuid() != 0:
            pytest.skip("only root gives files away")
        os.chown(prepared, owner, owner)
    with pytest.raises(RuntimeUnavailable, match=complaint):
        Runtime(tmp_path / "base", shared)


def test_what_outlives_a_run_is_for_its_user_alone(tmp_path, shared):
    runtime = Runtime(tmp_path / "base", shared)
    assert runtime.state_dir.stat().st_mode & 0o077 == 0
    runtime.close()
