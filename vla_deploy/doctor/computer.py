"""Check the computer: board, profile and memory, clocks, disk and shared memory."""

import ctypes
import os
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from platforms.probes.memory import meminfo_bytes
from platforms.tree import ValueMissing
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, fail, ok, warn

_GB: Final = 1e9
_MB: Final = 1e6


def board(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Name the board and its release."""
    found = context.board
    release = f", JetPack {found.jetpack or 'unknown'} (L4T {found.l4t})" if found.l4t else ""
    module = f", {found.module}" if found.module else ""
    if found.profile_name is None:
        yield warn("board", f"{found.name}: {found.reasons[-1]}", "vla-deploy profile list")
    else:
        yield ok("board", f"{found.name}{module}{release}")


def user(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Report which user's rights are examined: the service has its own user."""
    yield ok("examined as", "root" if context.rights.uid == 0 else f"user {context.rights.uid}")


def profile(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Compare the profile in use with the one made for this board."""
    made, used = context.board.profile_name, context.profile
    if context.profile_fault:
        yield fail("profile", context.profile_fault, "vla-deploy profile use NAME")
    elif used is None:
        yield fail("profile", "none to look at", "vla-deploy profile use NAME")
    elif made is None or used.name == made:
        yield ok("profile", used.name)
    else:
        yield warn(
            "profile", f"{used.name}, made for this: {made}", f"vla-deploy profile use {made}"
        )


def memory(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Compare processors and memory with what the profile needs."""
    if context.board.memory_bytes is None:
        raise ValueMissing("; ".join(one for one in context.board.reasons if "memory" in one))
    cpus = os.cpu_count() if context.is_live else None
    measured = f"{context.board.memory_bytes / _GB:.1f} GB" + (f", {cpus} CPUs" if cpus else "")
    needs = None if context.profile is None else context.profile.board
    if needs is not None and (
        context.board.memory_bytes < needs.memory_mb * _MB
        or (cpus or needs.cpu_count) < needs.cpu_count
    ):
        wanted = f"{needs.memory_mb / 1000:.1f} GB, {needs.cpu_count} CPUs"
        yield warn("memory", f"{measured}; the profile needs {wanted}", "vla-deploy profile detect")
    else:
        yield ok("memory", measured)


GOOD_SOURCES: Final = frozenset({"tsc", "arch_sys_counter", "kvm-clock"})
JUMP_S: Final = 5.0
_TIME_ERROR: Final = 5  # adjtimex(2): the clock is not synchronised
_TIMEX_BYTES: Final = 208
# utmp(5): type, pid, line, id, user, host, exit status, session, seconds; x86, then aarch64
_UTMP: Final = (
    struct.Struct("<hxxi32s4s32s256shhii40x"),
    struct.Struct("<hxxi32s4s32s256shhqq48x"),
)
_BOOT_TIME: Final = 2
_SECONDS: Final = 9


def clock_source(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that time is read from the processor's own counter."""
    folder = "/sys/devices/system/clocksource/clocksource0"
    source = context.tree.text(f"{folder}/current_clocksource")
    if source in GOOD_SOURCES:
        yield ok("clock source", source)
    else:
        remedy = f"cat {folder}/available_clocksource   # boot with clocksource=tsc"
        yield warn("clock source", f"{source}: reading the time is slow", remedy)


def wall_time(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that the wall clock follows a time server."""
    del context
    library = ctypes.CDLL(None, use_errno=True)
    state = library.adjtimex(ctypes.create_string_buffer(_TIMEX_BYTES))
    if state == _TIME_ERROR or state < 0:
        yield warn(
            "wall time",
            "follows no time server: times in logs may be wrong",
            "sudo timedatectl set-ntp true",
        )
    else:
        yield ok("wall time", "follows a time server")


def jump_since_boot(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Compare the time of boot as it was noted then with what it is by today's wall clock."""
    noted_s, now_s = _noted_boot_s(context), _boot_s(context)
    jump_s = now_s - noted_s
    if abs(jump_s) <= JUMP_S:
        yield ok("jump since boot", f"{jump_s:+.0f} s")
    else:
        measured = f"{jump_s:+.0f} s: wall times of earlier logs do not fit"
        yield warn("jump since boot", measured, "sudo hwclock --systohc   # and check its battery")


def _noted_boot_s(context: DoctorContext) -> float:
    try:
        content = (context.tree.root / "run/utmp").read_bytes()
    except OSError as error:
        raise ValueMissing(f"/run/utmp does not note it: {error.strerror}") from error
    for layout in _UTMP:
        if len(content) % layout.size:
            continue
        for record in layout.iter_unpack(content):
            if record[0] == _BOOT_TIME:
                return float(record[_SECONDS])
    raise ValueMissing("/run/utmp does not note the boot")


def _boot_s(context: DoctorContext) -> float:
    for line in context.tree.text("/proc/stat").splitlines():
        key, _, value = line.partition(" ")
        if key == "btime" and value.isdecimal():
            return float(value)
    raise ValueMissing("/proc/stat tells no btime")


FOLDERS: Mapping[str, Path] = {
    "state": Path("/var/lib/vla-deploy"),
    "logs": Path("/var/log/vla-deploy"),
}
LEAST_FREE_MB: Final = 500.0
AMPLE: Final = 4.0  # times the least that is needed
SHARED_MEMORY_BYTES: Final = 256 << 20


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
