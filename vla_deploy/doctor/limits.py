"""Check which limits of the kernel's control groups are real here."""

from collections.abc import Iterator, Mapping
from typing import Final

from platforms.probes import read_cgroup
from vla_deploy.doctor.boot import boot_option
from vla_deploy.doctor.context import Context
from vla_deploy.doctor.finding import Finding, ok, warn

# Controller, what it limits, and what takes its place where it is missing.
CONTROLLERS: Mapping[str, tuple[str, str]] = {
    "cpu": ("processor time", "nice and affinity"),
    "memory": ("memory", "rlimits and the ladder"),
    "cpuset": ("which processors", "affinity"),
    "io": ("disk traffic", "nothing"),
    "pids": ("number of processes", "rlimits"),
}
_SWITCH: Final = "systemd.unified_cgroup_hierarchy=1"


def control_groups(context: Context) -> Iterator[Finding]:
    """Tell the version, and for each controller whether its limit is real."""
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
    for name, (what, instead) in CONTROLLERS.items():
        if name in cgroup.controllers:
            note = ", but not of CUDA memory" if name == "memory" and context.board.l4t else ""
            yield ok(f"limit of {name}", f"real: {what}{note}")
        else:
            remedy = f"echo +{name} | sudo tee /sys/fs/cgroup/cgroup.subtree_control"
            yield warn(f"limit of {name}", f"not real: {instead} instead", remedy)
