"""Check what control needs of the kernel: real-time rights, locked memory, wake-ups, limits."""

import gzip
import os
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S
from platforms.probes import Cgroup, read_cgroup
from platforms.probes.cgroup import MOUNT, UNIFIED
from platforms.tree import ValueMissing
from vla_deploy.doctor.context import UNLIMITED, DoctorContext, boot_option
from vla_deploy.doctor.finding import DoctorFinding, fail, missing, ok, trouble, warn

LIMITS_FILE: Final = "/etc/security/limits.d/90-vla-deploy.conf"
MEMORY_LOCK_BYTES: Final = 512 << 20
WAKE_UP_TEST_S: Final = 1.0
LATE_RATIO: Final = 0.2  # of the period: a tick this late counts as late
FAIR_SERVER: Final = "/sys/kernel/debug/sched/fair_server"
_QUANTILE: Final = 0.99
_GROUP_OPTION: Final = "CONFIG_RT_GROUP_SCHED=y"
_ANY_OPTION: Final = "CONFIG_"


def wanted_priority(context: DoctorContext) -> int:
    """Return control's SCHED_FIFO priority in the profile, 0 for none."""
    return context.profile.realtime_priority if context.profile else 0


def _required(context: DoctorContext) -> bool:
    profile = context.profile
    return profile is not None and profile.realtime_required and profile.realtime_priority > 0


def preempt_rt(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Return whether the kernel preempts everywhere."""
    version = context.tree.text("/proc/version")
    if "PREEMPT_RT" in version:
        yield ok("kernel", "PREEMPT_RT")
    elif _required(context):
        remedy = (
            "apt-cache search nvidia-l4t-rt"
            if context.board.l4t
            else "sudo pro enable realtime-kernel"
        )
        yield warn("kernel", "no PREEMPT_RT: wake-ups may be late by milliseconds", remedy)
    else:
        yield ok("kernel", "no PREEMPT_RT, which the profile does not ask for")


def fifo(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that SCHED_FIFO is granted, by asking for it."""
    rights, name = context.rights, "SCHED_FIFO"
    if not rights.fifo_refusal:
        yield ok(name, "granted")
        return
    measured = f"{rights.fifo_refusal}; RLIMIT_RTPRIO is {rights.realtime_priority_limit}"
    remedy = f'echo "$USER - rtprio 80" | sudo tee -a {LIMITS_FILE}   # then log in anew'
    yield trouble(name, measured, remedy, fatal=_required(context))


def serial_data(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that the kernel's workers for serial data may run before ordinary processes."""
    if not wanted_priority(context):
        yield ok("serial data", "as any ordinary process, as the profile has no real-time priority")
    elif context.rights.may_raise_others:
        yield ok("serial data", "its kernel workers may go before ordinary processes")
    else:
        measured = "servo answers wait behind ordinary processes under load: no CAP_SYS_NICE"
        remedy = "sudo vla-deploy install   # the service has it; `vla-deploy bench serial` shows"
        yield warn("serial data", measured, remedy)


def realtime_share(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check how much of each period real-time processes may use."""
    runtime_us = context.tree.number("/proc/sys/kernel/sched_rt_runtime_us")
    period_us = context.tree.number("/proc/sys/kernel/sched_rt_period_us")
    remedy = "sudo sysctl -w kernel.sched_rt_runtime_us=950000"
    if runtime_us < 0:
        yield ok("real-time share", "no limit")
    elif runtime_us == 0 or period_us <= 0:
        yield fail("real-time share", "0 %: no real-time process may run", remedy)
    else:
        yield ok("real-time share", f"{100 * runtime_us / period_us:.0f} % of each period")


def fair_server(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check how long ordinary processes may take a core from real-time ones at a stretch.

    Linux 6.12 and newer has a server of `runtime` ns in every `period` for them, which goes before
    SCHED_FIFO (Documentation/scheduler/sched-deadline.rst).
    """
    cores = context.tree.names(FAIR_SERVER) or ("cpu0",)
    runtimes_ns = [context.tree.number(f"{FAIR_SERVER}/{core}/runtime") for core in cores]
    longest_ms = max(runtimes_ns) / 1e6
    if longest_ms <= 0.0 or not wanted_priority(context):
        yield ok("fair server", f"{longest_ms:.0f} ms")
        return
    measured = f"ordinary processes may take a core from control for {longest_ms:.0f} ms"
    yield warn("fair server", measured, f"echo 0 | sudo tee {FAIR_SERVER}/cpu*/runtime")


def group_scheduling(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check for RT_GROUP_SCHED, under which SCHED_FIFO fails below the root control group."""
    is_on = has_group_scheduling(context)
    if is_on is None:
        why = "no /proc/config.gz or /boot/config-*: the kernel does not tell how it was built"
        yield missing("RT_GROUP_SCHED", why)
    elif not is_on:
        yield ok("RT_GROUP_SCHED", "off")
    elif context.rights.fifo_refusal:
        yield warn(
            "RT_GROUP_SCHED",
            "on: SCHED_FIFO fails below the root control group",
            "echo $$ | sudo tee /sys/fs/cgroup/cgroup.procs",
        )
    else:
        yield ok("RT_GROUP_SCHED", "on, but SCHED_FIFO is granted here")


def has_group_scheduling(context: DoctorContext) -> bool | None:
    """Return whether the kernel has RT_GROUP_SCHED; None where that is unknown."""
    if context.tree.exists("/sys/fs/cgroup/cpu/cpu.rt_runtime_us"):
        return True
    options = _kernel_options(context)
    return _GROUP_OPTION in options if _ANY_OPTION in options else None


def _kernel_options(context: DoctorContext) -> str:
    """Return the kernel's configuration, from the kernel itself or from /boot."""
    try:
        packed = (context.tree.root / "proc/config.gz").read_bytes()
        return gzip.decompress(packed).decode(errors="replace")
    except (OSError, EOFError, zlib.error):
        return _options_in_boot(context)


def _options_in_boot(context: DoctorContext) -> str:
    try:
        release = context.tree.text("/proc/sys/kernel/osrelease")
        return context.tree.text(f"/boot/config-{release}")
    except ValueMissing:
        return ""


def memory_lock(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that control may keep its memory from being swapped out."""
    rights, name = context.rights, "memory lock"
    limit = rights.memory_lock_bytes
    if rights.may_lock_all or limit == UNLIMITED:
        yield ok(name, "unlimited")
    elif limit >= MEMORY_LOCK_BYTES:
        yield ok(name, f"{limit >> 20} MiB")
    else:
        remedy = f'echo "$USER - memlock unlimited" | sudo tee -a {LIMITS_FILE}   # log in anew'
        measured = f"{limit >> 10} KiB, expected {MEMORY_LOCK_BYTES >> 20} MiB"
        needed = context.profile is not None and context.profile.memory_lock
        yield trouble(name, measured, remedy, fatal=needed)


def wake_up(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Measure for a second how late this computer wakes a process at the control rate."""
    rate_hz = context.profile.control_rate_hz if context.profile else 250.0
    priority = wanted_priority(context)
    with _scheduled(priority) as how:
        late_ns = _lateness_ns(context, round(NS_PER_S / rate_hz))
    p99_ms = late_ns[int(_QUANTILE * len(late_ns))] / 1e6
    measured = f"p99 {p99_ms:.2f} ms, worst {late_ns[-1] / 1e6:.2f} ms late at {rate_hz:g} Hz {how}"
    limit_ms = 1000 * LATE_RATIO / rate_hz
    if p99_ms <= limit_ms:
        yield ok("wake-up", measured)
    else:
        remedy = "vla-deploy doctor   # again while the computer is idle; then see SCHED_FIFO"
        measured = f"{measured}, expected {limit_ms:.2g} ms"
        yield trouble("wake-up", measured, remedy, fatal=_required(context))


def _lateness_ns(context: DoctorContext, period_ns: int) -> list[int]:
    clock, late_ns = context.clock, []
    deadline_ns = clock.now_ns()
    for _ in range(round(WAKE_UP_TEST_S * NS_PER_S / period_ns)):
        deadline_ns += period_ns
        clock.sleep_until(deadline_ns)
        late_ns.append(max(clock.now_ns() - deadline_ns, 0))
    return sorted(late_ns)


@contextmanager
def _scheduled(priority: int) -> Iterator[str]:
    """Run as control does, as far as permitted; say how."""
    if not priority:
        yield "as an ordinary process"
        return
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        yield "without SCHED_FIFO"
        return
    try:
        yield f"with SCHED_FIFO {priority}"
    finally:
        os.sched_setscheduler(0, policy, parameters)


@dataclass(frozen=True, slots=True)
class SystemLimit:
    """Name the file that sets a limit, what it limits, and what takes its place where it is not."""

    file: str
    what: str
    instead: str


CONTROLLERS: Mapping[str, SystemLimit] = {
    "cpu": SystemLimit("cpu.max", "processor time", "nice and affinity"),
    "memory": SystemLimit("memory.max", "memory", "rlimits and the ladder"),
    "cpuset": SystemLimit("cpuset.cpus", "which processors", "affinity"),
    "io": SystemLimit("io.max", "disk traffic", "nothing"),
    "pids": SystemLimit("pids.max", "number of processes", "rlimits"),
}
_UNIFIED: Final = "systemd.unified_cgroup_hierarchy=1"
_OPTIONS: Final = "zgrep CGROUP /proc/config.gz   # what this kernel was built with"


def control_groups(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Return the version, and for each controller whether its limit is real."""
    cgroup = read_cgroup(context.tree)
    if cgroup.version != 2 or CONTROLLERS.keys().isdisjoint(cgroup.controllers):
        had = f"version {cgroup.version}" if cgroup.version else "none"
        because = f" ({cgroup.reason})" if cgroup.reason else ""
        yield warn(
            "control groups",
            f"{had}{because}: no limit is real",
            boot_option(context.tree, _UNIFIED),
        )
        return
    yield ok("control groups", "version 2")
    for name, limit in CONTROLLERS.items():
        objection, remedy = _objection(context, cgroup, name, limit)
        if objection:
            measured = f"not real, {objection}: {limit.instead} instead"
            yield warn(f"limit of {name}", measured, remedy)
        else:
            note = ", but not of CUDA memory" if name == "memory" and context.board.l4t else ""
            yield ok(f"limit of {name}", f"real: {limit.what}{note}")


def _objection(
    context: DoctorContext, cgroup: Cgroup, name: str, limit: SystemLimit
) -> tuple[str, str]:
    """Return why a limit is not real and the remedy, or nothing twice."""
    if name not in cgroup.controllers:
        remedy = f"echo +{name} | sudo tee /sys/fs/cgroup/cgroup.subtree_control"
        return "not enabled here", remedy
    if cgroup.folder in (MOUNT, UNIFIED):
        return "we are in the root group", "sudo vla-deploy install   # the service has its own"
    if not context.tree.exists(f"{cgroup.folder}/{limit.file}"):
        return f"the kernel has no {limit.file}", _OPTIONS
    if name == "cpu" and wanted_priority(context) and has_group_scheduling(context):
        return "RT_GROUP_SCHED would refuse SCHED_FIFO", _OPTIONS
    return "", ""
