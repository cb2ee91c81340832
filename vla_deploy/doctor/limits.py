"""Check which limits of the kernel's control groups are real here."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from platforms.probes import Cgroup, read_cgroup
from platforms.probes.cgroup import MOUNT, UNIFIED
from vla_deploy.doctor.boot import boot_option
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, ok, warn
from vla_deploy.doctor.realtime import has_group_scheduling, wanted_priority


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
_SWITCH: Final = "systemd.unified_cgroup_hierarchy=1"
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
            boot_option(context.tree, _SWITCH),
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
