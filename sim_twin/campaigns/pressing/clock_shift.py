"""Shift the wall clock of chosen processes, and of nobody else on the computer.

A small library, preloaded into every process of the robot, adds what a file says to CLOCK_REALTIME;
the monotonic clock is left alone, as it is when a time server sets a computer's clock.
"""

import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path
from typing import Final

_SOURCE: Final = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static const volatile long long *shift_s;
static int (*real_clock_gettime)(clockid_t, struct timespec *);

__attribute__((constructor)) static void open_shift(void) {
    const char *path = getenv("CLOCK_SHIFT_FILE");
    int fd = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    void *at = fd < 0 ? MAP_FAILED : mmap(NULL, 8, PROT_READ, MAP_SHARED, fd, 0);
    if (fd >= 0) close(fd);
    if (at != MAP_FAILED) shift_s = at;
    real_clock_gettime = dlsym(RTLD_NEXT, "clock_gettime");
}

int clock_gettime(clockid_t id, struct timespec *now) {
    if (!real_clock_gettime) real_clock_gettime = dlsym(RTLD_NEXT, "clock_gettime");
    int result = real_clock_gettime(id, now);
    if (!result && shift_s && (id == CLOCK_REALTIME || id == CLOCK_REALTIME_COARSE))
        now->tv_sec += *shift_s;
    return result;
}

int gettimeofday(struct timeval *now, void *zone) {
    struct timespec precise;
    (void)zone;
    int result = clock_gettime(CLOCK_REALTIME, &precise);
    now->tv_sec = precise.tv_sec;
    now->tv_usec = precise.tv_nsec / 1000;
    return result;
}

time_t time(time_t *now) {
    struct timespec precise;
    clock_gettime(CLOCK_REALTIME, &precise);
    if (now) *now = precise.tv_sec;
    return precise.tv_sec;
}
"""
_ASK: Final = "import time; print(time.time_ns() // 10**9, time.monotonic_ns() // 10**9)"
_TOLERANCE_S: Final = 30


class CannotShift(Exception):
    """Say why no clock can be shifted here."""


class ClockShift:
    """Own the library and the file that says by how many seconds the clock is shifted."""

    def __init__(self, folder: Path) -> None:
        """Build the library and prove that it works.

        Raises:
            CannotShift: there is no compiler, or the library has no effect.
        """
        self._file = folder / "clock_shift"
        self._library = folder / "clock_shift.so"
        self.set(0)
        _compile(folder / "clock_shift.c", self._library)
        self._prove()
        self.set(0)

    @property
    def environment(self) -> dict[str, str]:
        """Return what a process must be started with."""
        return {"LD_PRELOAD": str(self._library), "CLOCK_SHIFT_FILE": str(self._file)}

    def set(self, seconds: int) -> None:
        """Let the clock of every such process be off by so much from now on."""
        if not self._file.exists():
            self._file.write_bytes(bytes(8))
        with self._file.open("r+b") as file:
            file.write(struct.pack("=q", seconds))

    def is_in(self, pid: int) -> bool:
        """Return whether a process reads the shifted clock."""
        try:
            maps = Path(f"/proc/{pid}/maps").read_text(encoding="utf-8")
        except (FileNotFoundError, ProcessLookupError):
            return False
        return str(self._library) in maps and str(self._file) in maps

    def _prove(self) -> None:
        shift_s = 1_000_000
        wall_s, steady_s = self._ask()
        self.set(shift_s)
        later_wall_s, later_steady_s = self._ask()
        moved_s, passed_s = later_wall_s - wall_s, later_steady_s - steady_s
        if abs(moved_s - shift_s) > _TOLERANCE_S or abs(passed_s) > _TOLERANCE_S:
            raise CannotShift(f"a shift of {shift_s} s moved the clock by {moved_s} s")

    def _ask(self) -> tuple[int, int]:
        """Return the wall clock and the monotonic clock of a process that is started so."""
        done = subprocess.run(
            [sys.executable, "-S", "-c", _ASK],
            env={**os.environ, **self.environment},
            capture_output=True,
            text=True,
            check=True,
        )
        wall_s, steady_s = done.stdout.split()
        return int(wall_s), int(steady_s)


def _compile(source: Path, library: Path) -> None:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise CannotShift("there is no C compiler; install gcc")
    source.write_text(_SOURCE, encoding="utf-8")
    words = (compiler, "-O2", "-shared", "-fPIC", "-o", str(library), str(source), "-ldl")
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        raise CannotShift(f"{compiler}: {done.stderr.strip()}")
