"""A computer with a real systemd as its first process, in namespaces of its own."""

import contextlib
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[3]
BOOT = """
set -e
mount --make-rprivate /
mount -t proc proc /proc
umount -R /sys/fs/cgroup 2>/dev/null || true
mount -t cgroup2 cgroup2 /sys/fs/cgroup
mount --bind {python} {image}/opt/python
mount --bind {packages} {image}/opt/packages
mount --bind {source} {image}/opt/source
mount --rbind {image}/opt /opt
mount --bind {image}/etc /etc
# An interpreter that finds its library in somebody's home does not see that from the sandbox.
echo /opt/python/lib >/etc/ld.so.conf.d/00-python.conf
ldconfig
mount -t tmpfs tmpfs /run
mount -t tmpfs tmpfs /var/lib
mount -t tmpfs tmpfs /var/log
mount -t tmpfs tmpfs /var/tmp
exec env -i container=test PATH=/usr/sbin:/usr/bin:/sbin:/bin \
  SYSTEMD_UNIT_PATH=/etc/systemd/system /lib/systemd/systemd \
  --system --unit=test.target --log-target=console --log-level=info \
  --show-status=0
"""
TARGETS = ("sysinit", "basic", "shutdown", "local-fs", "network", "multi-user", "test")
INTERPRETER = Path("/opt/python/bin") / f"python{sys.version_info[0]}.{sys.version_info[1]}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Computer:
    """Run commands beside a systemd, and read what it says."""

    pid: int
    image: Path

    def logs(self) -> str:
        """Return the end of what systemd and the service have said."""
        logs = [self.image / "journal", self.image / "opt/service.log"]
        return "".join(log.read_text()[-4000:] for log in logs if log.is_file())

    def run(self, *command: str, check: bool = True) -> str:
        """Run a command in the computer; return what it printed."""
        enter = ["nsenter", "-t", str(self.pid), "-m", "-p", "-C"]
        done = subprocess.run([*enter, *command], capture_output=True, text=True, timeout=120)
        if check and done.returncode != 0:
            raise AssertionError(done.stderr + self.why_not() + self.logs())
        return done.stdout

    def why_not(self) -> str:
        """Return with which exit status the commands of each service ended."""
        return self.run("systemctl", "status", "--no-pager", "--full", "*.service", check=False)

    def show(self, unit: str, name: str) -> str:
        """Return one property of a unit."""
        return self.run("systemctl", "show", "--value", f"--property={name}", unit).strip()

    def await_that(self, holds: Callable[[], bool], limit_s: float = 50.0) -> None:
        """Wait until something holds; fail with the journal when it never does."""
        end_s = time.monotonic() + limit_s
        while not holds():
            assert time.monotonic() < end_s, self.logs()
            time.sleep(0.05)


def cgroup_mount() -> Path | None:
    """Return where control groups of version 2 are mounted, writable."""
    for line in Path("/proc/self/mounts").read_text().splitlines():
        _, path, kind, options, *_ = line.split()
        if kind == "cgroup2" and "rw" in options.split(","):
            return Path(path)
    return None


def why_no_systemd() -> str:
    """Return why this machine cannot start a systemd; empty when it can."""
    if os.geteuid() != 0:
        return "starting a systemd needs root"
    if not Path("/lib/systemd/systemd").exists():
        return "systemd is not installed: scripts/system-packages"
    if cgroup_mount() is None:
        return "no writable cgroup2 file system"
    command = [
        "unshare",
        "--mount",
        "--pid",
        "--fork",
        "--cgroup",
        "mount",
        "-t",
        "tmpfs",
        "t",
        "/mnt",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    return f"no namespaces here: {done.stderr.strip()}" if done.returncode else ""


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with /etc and /opt of a computer, and what its systemd needs to start."""
    why = why_no_systemd()
    if why:  # also because only root may copy all of /etc
        pytest.skip(why)
    folder = tmp_path_factory.mktemp("image")
    folder.chmod(0o755)
    folder.parent.chmod(0o755)
    units = folder / "etc/systemd/system"
    shutil.copytree("/etc", folder / "etc", symlinks=True, ignore=lambda *_: ["systemd"])
    for name in ("python", "packages", "source"):
        (folder / "opt" / name).mkdir(parents=True)
    units.mkdir(parents=True)
    for name in TARGETS:
        (units / f"{name}.target").write_text("[Unit]\nDefaultDependencies=no\n")
    return folder


@pytest.fixture(scope="module")
def add_environment() -> Callable[[Path], None]:
    return _add_environment


def _add_environment(release: Path) -> None:
    """Give a release an interpreter that the service can reach, with our packages and source."""
    packages = release / "venv/lib" / INTERPRETER.name / "site-packages"
    packages.mkdir(parents=True)
    (packages / "test.pth").write_text(
        "/opt/source\nimport site; site.addsitedir('/opt/packages')\n"
    )
    (release / "venv/pyvenv.cfg").write_text(f"home = {INTERPRETER.parent}\n")
    (release / "venv/bin").mkdir()
    (release / "venv/bin/python").symlink_to(INTERPRETER)
    (release / "bin").mkdir()


@pytest.fixture(scope="module")
def boot(image: Path) -> Iterator[Callable[[], Computer]]:
    """Return what starts the computer; it is switched off at the end."""
    mount = cgroup_mount()
    assert mount is not None
    group = mount / f"test-{os.getpid()}"
    group.mkdir()
    started: list[subprocess.Popen[bytes]] = []
    others = set(_private_folders())

    def start() -> Computer:
        script = BOOT.format(
            image=image,
            python=sys.base_prefix,
            packages=next(path for path in sys.path if path.endswith("site-packages")),
            source=SOURCE,
        )
        enter = f"echo $$ >{group}/cgroup.procs && exec unshare --mount --pid --fork --cgroup --uts"
        with (image / "journal").open("wb") as log:
            command = ["sh", "-c", f'{enter} --ipc --kill-child sh -c "$0"', script]
            process = subprocess.Popen(command, stdout=log, stderr=log)
        started.append(process)
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        return Computer(pid=_first(children), image=image)

    yield start
    for process in started:
        process.kill()
        process.wait()
    _remove_group(group)
    for folder in set(_private_folders()) - others:  # a systemd that is killed leaves them
        shutil.rmtree(folder, ignore_errors=True)


def _private_folders() -> Iterator[Path]:
    """Return the folders that services have here as their /tmp; tests' own files are beside."""
    return Path("/tmp").glob("systemd-private-*-vla-deploy*")


def _first(children: Path) -> int:
    end_s = time.monotonic() + 20
    while time.monotonic() < end_s:
        words = children.read_text().split()
        if words and Path(f"/proc/{words[0]}/comm").read_text() == "systemd\n":
            return int(words[0])
        time.sleep(0.05)
    raise AssertionError("systemd did not start")


def _remove_group(group: Path) -> None:
    end_s = time.monotonic() + 10
    while group.exists():
        assert time.monotonic() < end_s, f"{group} is still in use"
        for folder in sorted(group.rglob("*/"), reverse=True):
            with contextlib.suppress(OSError):  # a process that was just killed still leaves it
                folder.rmdir()
        with contextlib.suppress(OSError):
            group.rmdir()
        time.sleep(0.05)
