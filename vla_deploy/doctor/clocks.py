"""Check the clocks: their source, whether wall time is set, and whether it jumped since boot."""

import ctypes
import struct
from collections.abc import Iterator
from typing import Final

from platforms.tree import ValueMissing
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, ok, warn

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
