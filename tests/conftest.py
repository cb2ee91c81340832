import contextlib
import errno
import fcntl
import gc
import json
import os
import socket
import subprocess
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

from vla_deploy.gateways.ros.shared_memory import remove_leftovers
from vla_deploy.supervisor.errors import RosNotFound
from vla_deploy.supervisor.processes.ros_environment import (
    RosEnvironment,
    find_environment,
    link_packages,
)

# How long an example takes tells how busy the machine is, not whether the code is right.
settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")

# Collecting garbage as often as usual takes a twentieth of all tests: thousands of test items stay.
gc.set_threshold(50_000, 20, 20)

# Whichever test loads onnxruntime first: it phones home otherwise.
os.environ["ORT_DISABLE_TELEMETRY"] = "1"

SHARING = ("end_to_end/browser", "end_to_end/ros")
"""Folders whose tests share one robot."""


class FileScheduling(LoadScopeScheduling):
    """Give each file to one worker, and the files that share a robot together to one."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return next((folder for folder in SHARING if f"{folder}/" in file), file)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> LoadScopeScheduling | None:
    return FileScheduling(config, log) if config.getvalue("dist") == "loadfile" else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Refuse a mark that comes from elsewhere: `scripts/check` would run such a test nowhere."""
    for path in sorted({item.path for item in items if item.get_closest_marker("stack")}):
        if "mark.stack" not in path.read_text(encoding="utf-8"):
            raise pytest.UsageError(f"{path}: tests marked `stack`; write pytest.mark.stack here")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol() -> Iterator[None]:
    """Give each test the mask of new files anew: a robot's process that runs in a test sets it."""
    own = os.umask(0o022)
    os.umask(own)
    try:
        return (yield)
    finally:
        os.umask(own)


@pytest.hookimpl(tryfirst=True)
def pytest_collection() -> None:
    """Disable garbage collection while ten thousand tests are collected."""
    gc.disable()


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Keep ten thousand collected tests out of every later collection of garbage."""
    gc.collect()
    gc.freeze()
    gc.enable()


TREES = Path(__file__).parent / "platforms" / "trees"


@pytest.fixture(scope="session")
def unused_port() -> Callable[[], int]:
    """Find a TCP port of loopback that nobody listens on."""

    def find() -> int:
        with socket.create_server(("127.0.0.1", 0)) as server:
            return int(server.getsockname()[1])

    return find


@pytest.fixture(scope="session")
def coarse() -> str:
    """A profile with fewer ticks: for what is done and told, not how soon."""
    return str(Path(__file__).with_name("coarse.toml"))


@pytest.fixture
def failing_reads(monkeypatch: pytest.MonkeyPatch) -> dict[Path, int]:
    """Reading a file named here fails with its errno, as no file on a disk would."""
    failures: dict[Path, int] = {}
    pread = os.pread

    def pread_or_fail(handle: int, count: int, offset: int) -> bytes:
        number = failures.get(Path(f"/proc/self/fd/{handle}").readlink())
        if number is not None:
            raise OSError(number, os.strerror(number))
        return pread(handle, count, offset)

    monkeypatch.setattr(os, "pread", pread_or_fail)
    return failures


@pytest.fixture
def board_tree(tmp_path: Path, failing_reads: dict[Path, int]) -> Callable[[str], Path]:
    """Lay out the files of a board described in tests/platforms/trees; return their root."""

    def lay_out(name: str) -> Path:
        description = tomllib.loads((TREES / f"{name}.toml").read_text())
        root = tmp_path / name
        for path, text in description["files"].items():
            file = root / path.lstrip("/")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        for path in description.get("asleep", ()):
            failing_reads[root / path.lstrip("/")] = errno.EAGAIN
        return root

    return lay_out


ROS_DOMAINS = range(40, 102)
"""Domains that tests take, one for each of them; 101 is the last that Linux leaves alone."""


@dataclass(frozen=True, kw_only=True)
class RosGraph:
    """A ROS graph of its own on this computer, and the way to take part in it.

    `variables` is the whole environment of a process in it: it can import our packages, too.
    """

    python: Path
    variables: Mapping[str, str]
    folder: Path
    started: list["subprocess.Popen[str]"] = field(default_factory=list)

    def run(self, script: str, *arguments: str, timeout_s: float = 40.0) -> Any:
        """Run a script to its end; return the JSON document of its last line."""
        process = self.start(script, *arguments)
        try:
            out, err = process.communicate(timeout=timeout_s)
        except subprocess.TimeoutExpired:
            process.kill()
            out, err = process.communicate()
            pytest.fail(f"the script did not end within {timeout_s:g} s:\n{out}\n{err}")
        assert process.returncode == 0, f"ended with {process.returncode}:\n{out}\n{err}"
        return json.loads(out.splitlines()[-1])

    def start(self, script: str, *arguments: str) -> "subprocess.Popen[str]":
        """Start a script that ends with the test at the latest; its output is in pipes."""
        file = self.folder / f"script_{len(self.started)}.py"
        file.write_text(script)
        process = subprocess.Popen(
            [self.python, file, *arguments],
            env=dict(self.variables),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.started.append(process)
        return process


@pytest.fixture(scope="session")
def ros_environment() -> RosEnvironment:
    """Skip the test where this computer has no ROS."""
    try:
        return find_environment()
    except RosNotFound as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session")
def ros_domain() -> Iterator[int]:
    """Take a domain that no other run of tests on this computer has."""
    for domain in ROS_DOMAINS:
        lock = Path(f"/tmp/vla-deploy-ros-domain-{domain}.lock")
        with contextlib.suppress(OSError), lock.open("w") as held:  # taken, or another user's
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            yield domain
            return
    pytest.fail(f"every ROS domain from {ROS_DOMAINS.start} to {ROS_DOMAINS.stop - 1} is taken")


@pytest.fixture
def ros_graph(
    ros_environment: RosEnvironment, ros_domain: int, tmp_path: Path
) -> Iterator[RosGraph]:
    folder = tmp_path / "ros_graph"
    packages = link_packages(folder / "packages")
    python_path = [str(packages), ros_environment.variables.get("PYTHONPATH", "")]
    graph = RosGraph(
        python=ros_environment.python,
        variables={
            **os.environ,
            **ros_environment.variables,
            "PYTHONPATH": os.pathsep.join(path for path in python_path if path),
            "ROS_DOMAIN_ID": str(ros_domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "ROS_LOG_DIR": str(folder / "log"),
            "ROS_PYTHON_CHECK_FIELDS": "1",  # else a wrong type passes silently
        },
        folder=folder,
    )
    yield graph
    for process in graph.started:
        process.terminate()
    for process in graph.started:
        try:
            process.communicate(timeout=5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
    if any(process.returncode for process in graph.started):
        remove_leftovers()  # young ones stay: they may be a process's of another test that starts
