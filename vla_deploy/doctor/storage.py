"""Check room on disk and in shared memory, and swap."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from platforms.probes.memory import meminfo_bytes
from platforms.tree import ValueMissing
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, fail, ok, warn

FOLDERS: Mapping[str, Path] = {
    "state": Path("/var/lib/vla-deploy"),
    "logs": Path("/var/log/vla-deploy"),
}
LEAST_FREE_MB: Final = 500.0
AMPLE: Final = 4.0  # times the least that is needed
SHARED_MEMORY_BYTES: Final = 256 << 20
_MB: Final = 1e6


def disks(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check the file systems on which state and logs are, or will be."""
    least_mb = max(LEAST_FREE_MB, context.profile.total.disk_free_mb if context.profile else 0.0)
    for name, folder in FOLDERS.items():
        free_mb = _free_bytes(context.tree.root, folder) / _MB
        measured, remedy = f"{free_mb / 1000:.1f} GB free for {folder}", f"sudo du -xh -d2 {folder}"
        if free_mb < least_mb:
            measured = f"{measured}, expected {least_mb / 1000:.1f} GB"
            yield fail(f"disk, {name}", measured, "sudo journalctl --vacuum-size=200M")
        elif free_mb < AMPLE * least_mb:
            yield warn(f"disk, {name}", measured, remedy)
        else:
            yield ok(f"disk, {name}", measured)


def shared_memory(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that the topics between processes find room."""
    free = _free_bytes(context.tree.root, Path("/dev/shm"))
    measured = f"{free / _MB:.0f} MB free in /dev/shm"
    if free < SHARED_MEMORY_BYTES:
        remedy = "sudo mount -o remount,size=1G /dev/shm"
        yield fail("shared memory", f"{measured}, expected {SHARED_MEMORY_BYTES / _MB:.0f}", remedy)
    else:
        yield ok("shared memory", measured)


def swap(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that no memory is out on a disk: fetching it back takes longer than a tick."""
    rows = meminfo_bytes(context.tree.text("/proc/meminfo"))
    total, free = rows.get("SwapTotal"), rows.get("SwapFree")
    if total is None or free is None:
        raise ValueMissing("/proc/meminfo tells nothing of swap")
    devices = context.tree.text("/proc/swaps").splitlines()[1:]
    disks_used = [row.split()[0] for row in devices if row.split() and "zram" not in row]
    used = f"{(total - free) / _MB:.0f} of {total / _MB:.0f} MB used"
    if not total:
        yield ok("swap", "none")
    elif not disks_used:
        yield ok("swap", f"zram, {used}")
    elif total - free > 0:
        yield warn("swap", f"{', '.join(disks_used)}, {used}", "sudo swapoff -a")
    else:
        yield ok("swap", f"{', '.join(disks_used)}, {used}")


def _free_bytes(root: Path, folder: Path) -> float:
    """Return the room where the folder is, or would be made."""
    path = root / str(folder).lstrip("/")
    while not os.access(path, os.F_OK) and path not in (root, path.parent):
        path = path.parent
    try:
        found = os.statvfs(path)
    except OSError as error:
        raise ValueMissing(f"{path}: {error.strerror}") from error
    return float(found.f_bavail * found.f_frsize)
