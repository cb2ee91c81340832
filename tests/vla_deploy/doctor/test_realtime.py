import gzip
import os
from dataclasses import replace

import pytest

from platforms.tree import ValueMissing
from vla_deploy.doctor import FindingLevel
from vla_deploy.doctor import realtime as checks
from vla_deploy.doctor.context import UNLIMITED

PROFILES = (("desktop", FindingLevel.WARN), ("robot", FindingLevel.FAIL))
MS = 1_000_000


@pytest.mark.parametrize(("profile", "level"), PROFILES)
def test_refused_rights_fail_where_the_profile_needs_them(
    computer, stripped, profile, level
) -> None:
    context = stripped(computer.context(profile))
    (fifo,) = checks.fifo(context)
    (lock,) = checks.memory_lock(context)
    assert (fifo.level, lock.level) == (level, level)
    assert "RLIMIT_RTPRIO is 0" in fifo.measured
    assert "rtprio 80" in fifo.remedy
    assert "memlock unlimited" in lock.remedy


def test_granted_rights_are_fine(computer) -> None:
    context = computer.context("robot")
    (fifo,) = checks.fifo(context)
    (lock,) = checks.memory_lock(context)
    assert (fifo.level, lock.level) == (FindingLevel.OK, FindingLevel.OK)


@pytest.mark.parametrize(
    ("limit", "may_lock_all", "level"),
    [
        (512 << 20, False, FindingLevel.OK),
        ((512 << 20) - 1, False, FindingLevel.FAIL),
        (0, True, FindingLevel.OK),
        (UNLIMITED, False, FindingLevel.OK),
    ],
)
def test_memory_lock_is_judged_by_limit_or_capability(computer, limit, may_lock_all, level) -> None:
    context = computer.context("robot")
    rights = replace(context.rights, memory_lock_bytes=limit, may_lock_all=may_lock_all)
    (finding,) = checks.memory_lock(replace(context, rights=rights))
    assert finding.level is level


@pytest.mark.parametrize(
    ("allowed", "level"), [(True, FindingLevel.OK), (False, FindingLevel.WARN)]
)
def test_serial_data_waits_where_kernel_workers_may_not_be_raised(computer, allowed, level) -> None:
    context = computer.context("robot")
    rights = replace(context.rights, may_raise_others=allowed)
    (finding,) = checks.serial_data(replace(context, rights=rights))
    assert finding.level is level


@pytest.mark.parametrize(
    ("version", "profile", "level"),
    [
        ("Linux version 5.15.148-rt SMP PREEMPT_RT", "robot", FindingLevel.OK),
        ("Linux version 5.15.148-tegra SMP PREEMPT", "robot", FindingLevel.WARN),
        ("Linux version 6.8.0 SMP PREEMPT_DYNAMIC", "desktop", FindingLevel.OK),
    ],
)
def test_preempt_rt_matters_where_the_profile_is_real_time(
    computer, version, profile, level
) -> None:
    computer.write("/proc/version", version)
    (finding,) = checks.preempt_rt(computer.context(profile))
    assert finding.level is level


@pytest.mark.parametrize(
    ("runtime_us", "level", "words"),
    [
        ("950000", FindingLevel.OK, "95 %"),
        ("-1", FindingLevel.OK, "no limit"),
        ("0", FindingLevel.FAIL, "no real-time process may run"),
    ],
)
def test_the_real_time_share_is_told(computer, runtime_us, level, words) -> None:
    computer.write("/proc/sys/kernel/sched_rt_runtime_us", runtime_us)
    computer.write("/proc/sys/kernel/sched_rt_period_us", "1000000")
    (finding,) = checks.realtime_share(computer.context())
    assert finding.level is level
    assert words in finding.measured


@pytest.mark.parametrize(
    ("runtime_ns", "level"), [("50000000", FindingLevel.WARN), ("0", FindingLevel.OK)]
)
def test_a_fair_server_that_may_hold_control_up_is_told(computer, runtime_ns, level) -> None:
    for core in ("cpu0", "cpu1"):
        computer.write(f"{checks.FAIR_SERVER}/{core}/runtime", "0")
    computer.write(f"{checks.FAIR_SERVER}/cpu1/runtime", runtime_ns)
    (finding,) = checks.fair_server(computer.context("robot"))
    assert finding.level is level
    assert f"{int(runtime_ns) // 1_000_000} ms" in finding.measured


def test_a_kernel_that_hides_its_fair_server_is_not_judged(computer) -> None:
    with pytest.raises(ValueMissing, match="fair_server/cpu0/runtime"):
        list(checks.fair_server(computer.context("robot")))


@pytest.mark.parametrize(
    ("path", "content"),
    [
        ("/sys/fs/cgroup/cpu/cpu.rt_runtime_us", b"950000"),
        ("/proc/config.gz", gzip.compress(b"CONFIG_SMP=y\nCONFIG_RT_GROUP_SCHED=y\n", mtime=0)),
        ("/boot/config-5.15.148-tegra", b"CONFIG_RT_GROUP_SCHED=y\n"),
    ],
)
def test_group_scheduling_is_found_wherever_the_kernel_tells_it(
    computer, stripped, path, content
) -> None:
    computer.write("/proc/sys/kernel/osrelease", "5.15.148-tegra\n")
    (before,) = checks.group_scheduling(stripped(computer.context()))
    assert before.level is FindingLevel.MISSING
    computer.write(path).write_bytes(content)
    (finding,) = checks.group_scheduling(stripped(computer.context()))
    assert finding.level is FindingLevel.WARN
    (granted,) = checks.group_scheduling(computer.context())
    assert granted.level is FindingLevel.OK


def test_a_damaged_kernel_configuration_harms_nothing(computer) -> None:
    computer.write("/proc/config.gz").write_bytes(b"\x1f\x8b garbage")
    (finding,) = checks.group_scheduling(computer.context())
    assert finding.level is FindingLevel.MISSING


def test_group_scheduling_is_off_only_where_the_kernel_says_so(computer) -> None:
    options = gzip.compress(b"CONFIG_SMP=y\n# CONFIG_RT_GROUP_SCHED is not set\n", mtime=0)
    computer.write("/proc/config.gz").write_bytes(options)
    (finding,) = checks.group_scheduling(computer.context())
    assert (finding.level, finding.measured) == (FindingLevel.OK, "off")


@pytest.mark.parametrize(
    ("late_ms", "desktop", "real_time"),
    [
        (0.0, FindingLevel.OK, FindingLevel.OK),
        (0.8, FindingLevel.OK, FindingLevel.OK),
        (0.9, FindingLevel.WARN, FindingLevel.FAIL),
    ],
)
def test_wake_ups_are_judged_by_their_lateness(computer, late_ms, desktop, real_time) -> None:
    for profile, level in (("desktop", desktop), ("robot", real_time)):
        context = computer.context(profile)
        context.clock.late_ns = lambda _: round(late_ms * MS)
        (finding,) = checks.wake_up(context)
        assert finding.level is level
        assert f"p99 {late_ms:.2f} ms" in finding.measured


def test_one_late_wake_up_in_two_hundred_and_fifty_is_told_but_not_judged(computer) -> None:
    context = computer.context()
    context.clock.late_ns = lambda number: 40 * MS if number == 100 else 0
    (finding,) = checks.wake_up(context)
    assert finding.level is FindingLevel.OK
    assert "worst 40.00 ms" in finding.measured


def test_the_measurement_leaves_the_scheduling_as_it_was(computer) -> None:
    before = os.sched_getscheduler(0), os.sched_getparam(0).sched_priority
    list(checks.wake_up(computer.context("robot")))
    assert (os.sched_getscheduler(0), os.sched_getparam(0).sched_priority) == before


CGROUP = "/sys/fs/cgroup/cgroup.controllers"


@pytest.fixture
def groups(computer):
    """Put us into a group of our own that has two controllers."""
    computer.write("/proc/self/cgroup", "0::/robot\n")
    computer.write(CGROUP, "cpu memory pids\n")
    folder = "/sys/fs/cgroup/robot"
    computer.write(f"{folder}/cgroup.controllers", "cpu memory\n")
    for name in ("cpu.max", "memory.max"):
        computer.write(f"{folder}/{name}", "max\n")
    return computer


def limit_of(computer, name, profile="desktop"):
    findings = checks.control_groups(computer.context(profile))
    return next(one for one in findings if one.name == f"limit of {name}")


def test_each_controller_is_told_real_or_not(groups) -> None:
    assert limit_of(groups, "memory").level is FindingLevel.OK
    assert limit_of(groups, "cpu").level is FindingLevel.OK
    pids = limit_of(groups, "pids")
    assert pids.level is FindingLevel.WARN
    assert pids.measured == "not real, not enabled here: rlimits instead"
    assert pids.remedy.startswith("echo +pids")


def test_nothing_is_limited_in_the_root_group(groups) -> None:
    groups.write("/proc/self/cgroup", "0::/\n")
    memory = limit_of(groups, "memory")
    assert memory.level is FindingLevel.WARN
    assert "we are in the root group" in memory.measured
    assert memory.remedy.startswith("sudo vla-deploy install")


def test_a_controller_without_its_file_limits_nothing(groups) -> None:
    (groups.root / "sys/fs/cgroup/robot/cpu.max").unlink()
    cpu = limit_of(groups, "cpu")
    assert (cpu.level, limit_of(groups, "memory").level) == (FindingLevel.WARN, FindingLevel.OK)
    assert cpu.measured == "not real, the kernel has no cpu.max: nice and affinity instead"


def test_processor_time_is_not_limited_where_that_would_cost_control_its_priority(groups) -> None:
    options = gzip.compress(b"CONFIG_RT_GROUP_SCHED=y\n", mtime=0)
    groups.write("/proc/config.gz").write_bytes(options)
    cpu = limit_of(groups, "cpu", "robot")
    assert cpu.level is FindingLevel.WARN
    assert "RT_GROUP_SCHED would refuse SCHED_FIFO" in cpu.measured
    assert limit_of(groups, "memory", "robot").level is FindingLevel.OK


def test_a_jetson_is_told_that_cuda_memory_is_not_counted(board_tree, computer) -> None:
    computer.root = board_tree("orin_nano_8gb_super")
    assert limit_of(computer, "memory").measured == "real: memory, but not of CUDA memory"


@pytest.mark.parametrize("boot", ["/boot/extlinux/extlinux.conf", "/etc/default/grub"])
def test_old_control_groups_limit_nothing_and_the_remedy_fits_the_boot_loader(
    computer, boot
) -> None:
    computer.write("/proc/self/cgroup", "3:memory:/\n")
    computer.write(boot)
    (finding,) = checks.control_groups(computer.context())
    assert finding.level is FindingLevel.WARN
    assert f"sudoedit {boot}" in finding.remedy
