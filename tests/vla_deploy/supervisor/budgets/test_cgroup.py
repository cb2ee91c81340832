import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from platforms.probes.cgroup import MOUNT, UNIFIED
from vla_deploy.supervisor.budgets.cgroup import (
    CgroupRefused,
    CgroupTree,
    cpu_max,
    memory_bytes,
)

UNIT = "sys/fs/cgroup/system.slice/vla-deploy.service"
FILES = ("cgroup.procs", "memory.high", "memory.max", "cpu.max", "cpu.weight", "pids.max")


def tree(
    root: Path,
    offered: str = "memory cpu pids",
    enabled: str = "memory cpu pids",
    missing: tuple[str, ...] = (),
) -> Path:
    """Lay out a unit's control group whose controllers are on already."""
    unit = root / UNIT
    group = unit / "planner"
    group.mkdir(parents=True)
    (root / "proc/self").mkdir(parents=True)
    (root / "proc/self/cgroup").write_text("0::/system.slice/vla-deploy.service\n")
    (root / "sys/fs/cgroup/cgroup.controllers").write_text(offered)
    (unit / "cgroup.controllers").write_text(f"{offered}\n")
    (unit / "cgroup.subtree_control").write_text(f"{enabled}\n")
    for name in set(FILES) - set(missing):
        (group / name).write_text("max\n" * 40)
    return group


def fill(group: Path) -> None:
    for name in FILES:
        if (group / name).exists():
            (group / name).write_text("")


def test_controllers_that_are_on_are_usable(tmp_path: Path):
    tree(tmp_path)
    assert CgroupTree(tmp_path).usable == ("memory", "cpu", "pids")


def test_a_limit_counts_when_it_reads_back(tmp_path: Path):
    group = tree(tmp_path)
    fill(group)
    CgroupTree(tmp_path).limit("planner", "memory.max", "4096")
    assert (group / "memory.max").read_text() == "4096"


def test_a_limit_that_reads_back_otherwise_is_refused(tmp_path: Path):
    tree(tmp_path)  # what is written here does not cut off what stood behind it
    with pytest.raises(CgroupRefused, match=r"memory\.max says '4096"):
        CgroupTree(tmp_path).limit("planner", "memory.max", "4096")


def test_a_controller_that_stays_off_is_refused(tmp_path: Path):
    tree(tmp_path, enabled="memory")
    cgroups = CgroupTree(tmp_path)
    assert cgroups.usable == ("memory",)
    assert "does not list" in cgroups.refusals["cpu"]


def test_a_real_time_kernel_without_bandwidth_control_has_no_cpu_limit(tmp_path: Path):
    group = tree(tmp_path, missing=("cpu.max",))
    fill(group)
    with pytest.raises(CgroupRefused, match=r"no cpu\.max: this kernel cannot"):
        CgroupTree(tmp_path).limit("planner", "cpu.max", cpu_max(0.5))


def test_a_kernel_that_groups_real_time_processes_gets_no_cpu_controller(tmp_path: Path):
    import gzip

    tree(tmp_path)
    config = gzip.compress(b"CONFIG_CGROUPS=y\nCONFIG_RT_GROUP_SCHED=y\n")
    (tmp_path / "proc/config.gz").write_bytes(config)
    assert "SCHED_FIFO" in CgroupTree(tmp_path, realtime=True).refusals["cpu"]
    assert "cpu" in CgroupTree(tmp_path, realtime=False).usable


def test_a_controller_that_the_kernel_lacks_is_named(tmp_path: Path):
    tree(tmp_path, offered="cpu pids", enabled="cpu pids")
    cgroups = CgroupTree(tmp_path)
    assert cgroups.refusals == {"memory": f"/{UNIT} does not offer the controller memory"}


def test_the_root_group_is_left_alone(tmp_path: Path):
    tree(tmp_path)
    (tmp_path / "proc/self/cgroup").write_text("0::/\n")
    refusals = set(CgroupTree(tmp_path).refusals.values())
    assert refusals == {
        "the supervisor runs in the root group: start it as a service with Delegate=yes"
    }


def test_a_machine_without_control_groups_says_so(tmp_path: Path):
    assert set(CgroupTree(tmp_path).refusals) == {"memory", "cpu", "pids"}


def test_this_machine_answers_for_every_controller():
    cgroups = CgroupTree()
    cgroups.close()
    assert set(cgroups.usable) | set(cgroups.refusals) == {"memory", "cpu", "pids"}
    assert all(cgroups.refusals.values())


WORKER = """
import os, subprocess, sys
from vla_deploy.supervisor.budgets.cgroup import CgroupRefused, CgroupTree
sys.stdin.readline()  # until the test has moved this process into its group
cgroups = CgroupTree(controllers=("hugetlb", "memory"))
print(cgroups.usable, cgroups.refusals)
with subprocess.Popen([sys.executable, "-c", "import sys; sys.stdin.read()"],
                      stdin=subprocess.PIPE) as child:
    cgroups.limit("worker", "hugetlb.2MB.max", "4194304")
    cgroups.place("worker", child.pid)
    print(open(f"/proc/{child.pid}/cgroup").read().split("0::")[1].strip())
try:
    cgroups.limit("worker", "memory.max", "4096")
except CgroupRefused as refusal:
    print(refusal)
cgroups.close()
print(open("/proc/self/cgroup").read().split("0::")[1].strip())
"""


@pytest.fixture
def delegated() -> Iterator[Path]:
    """Make a real control group, as a service manager does, with the controllers this one has."""
    mount = next(
        (one for one in (Path(UNIFIED), Path(MOUNT)) if (one / "cgroup.subtree_control").exists()),
        None,
    )
    if os.geteuid() != 0 or mount is None:
        pytest.skip("only root may make control groups, where there is version 2")
    if "hugetlb" not in (mount / "cgroup.controllers").read_text():
        pytest.skip("the controller that this test borrows belongs to others here")
    before = (mount / "cgroup.subtree_control").read_text().split()
    group = mount / f"vla-deploy-test-{os.getpid()}"
    group.mkdir()
    (mount / "cgroup.subtree_control").write_text("+hugetlb")
    yield group
    for folder in (*(one for one in group.iterdir() if one.is_dir()), group):
        folder.rmdir()
    if "hugetlb" not in before:
        (mount / "cgroup.subtree_control").write_text("-hugetlb")


@pytest.mark.stack
def test_a_real_group_is_left_for_a_leaf_and_takes_limits_that_read_back(delegated: Path):
    with subprocess.Popen(
        [sys.executable, "-c", WORKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as worker:
        (delegated / "cgroup.procs").write_text(str(worker.pid))
        told, _ = worker.communicate("go\n", timeout=60)
    usable, child, refusal, own = told.splitlines()
    assert usable.startswith("('hugetlb',) {'memory': ")
    assert child == f"/{delegated.name}/worker"
    assert refusal.startswith("there is no memory.max")
    assert own == f"/{delegated.name}/supervisor"
    assert not (delegated / "worker").exists()


def test_limits_are_whole_pages_and_periods():
    assert int(memory_bytes(100)) % 4096 == 0
    assert 0 <= 100_000_000 - int(memory_bytes(100)) < 65536
    assert cpu_max(0.25) == "25000 100000"
