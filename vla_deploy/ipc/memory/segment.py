"""Open the memory-mapped file of one topic, whoever comes first creates it."""

import errno
import fcntl
import mmap
import os
import struct
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc.errors import SchemaMismatch, SpaceUnavailable
from vla_deploy.ipc.memory.layout import VERSION, SlotLayout, file_name, layout_of, schema_hash
from vla_deploy.ipc.topics import Topic

_MAGIC = b"VLAIPC\x00\x01"
_HEADER = struct.Struct("<8sIIQ36s")  # magic, version, schema hash, file size, boot id
_SEQUENCE = struct.Struct("<Q")  # in front of each slot
# The newest sequence lies in the 13th 64-bit word, on a cache line of its own; next to it that of
# whoever went past the lock, so that its holder cannot take it back.
_NEWEST_WORD = 12
_FORCED_WORD = 13
_MOST_SEQUENCE = 2**62  # a million a second take 146,000 years to it
_LOCK_POLL_NS = NS_PER_S // 5000
_SHM = Path("/dev/shm")


class Segment:
    """Hold one topic's mapped file and the sequence of its newest slot.

    Raises:
        SchemaMismatch: the file was made with another layout.
        SpaceUnavailable: the file cannot be opened or its memory cannot be reserved.
    """

    def __init__(self, directory: Path, topic: Topic[Any], *, writable: bool) -> None:
        self.path = directory / file_name(topic)
        self.layout = layout_of(topic)
        self._fd = _open(self.path)
        self._close_fd = weakref.finalize(self, os.close, self._fd)
        if not _is_laid_out(self._fd, topic, self.layout):
            with self.locked():
                _create_or_check(self._fd, self.path, topic, self.layout)
        access = mmap.ACCESS_WRITE if writable else mmap.ACCESS_READ
        self.memory = mmap.mmap(self._fd, self.layout.file_bytes, access=access)
        # A 64-bit word is loaded and stored whole; struct would go byte by byte.
        self._words = memoryview(self.memory)[: (_FORCED_WORD + 1) * 8].cast("Q")

    @property
    def newest(self) -> int:
        """Return the newest published sequence, 0 before the first."""
        newest, forced = self._counted(_NEWEST_WORD), self._counted(_FORCED_WORD)
        return newest if newest > forced else forced

    @newest.setter
    def newest(self, sequence: int) -> None:
        self._words[_NEWEST_WORD] = sequence
        if self._words[_FORCED_WORD] > _MOST_SEQUENCE:
            self._words[_FORCED_WORD] = 0

    def force_newest(self, sequence: int) -> bool:
        """Publish a sequence without the lock; False where its holders have come as far already."""
        self._words[_FORCED_WORD] = sequence
        return self._counted(_NEWEST_WORD) < sequence

    def _counted(self, word: int) -> int:
        """Return a sequence; one that nobody can have counted to is spoilt: the slots know better.

        So neither writers nor readers stop, as a press of the stop must not.
        """
        sequence = self._words[word]
        return sequence if sequence <= _MOST_SEQUENCE else self._newest_slot()

    def _newest_slot(self) -> int:
        offsets = (self.layout.offset(slot) for slot in range(self.layout.slots))
        fronts = (_SEQUENCE.unpack_from(self.memory, offset)[0] for offset in offsets)
        return max((front for front in fronts if front <= _MOST_SEQUENCE), default=0)

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Exclude other writers; the kernel lets go when the holder is killed."""
        fcntl.flock(self._fd, fcntl.LOCK_EX)
        try:
            yield
        finally:
            fcntl.flock(self._fd, fcntl.LOCK_UN)

    @contextmanager
    def locked_within(self, patience_ns: int, clock: Clock) -> Iterator[bool]:
        """Exclude other writers where the holder lets go in time; yield whether it did."""
        is_held = self._lock_until(clock.now_ns() + patience_ns, clock)
        try:
            yield is_held
        finally:
            if is_held:
                fcntl.flock(self._fd, fcntl.LOCK_UN)

    def _lock_until(self, end_ns: int, clock: Clock) -> bool:
        while True:
            try:
                fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                if clock.now_ns() >= end_ns:
                    return False
                clock.sleep_until(clock.now_ns() + _LOCK_POLL_NS)
            else:
                return True

    def close(self) -> None:
        """Unmap the file; closing twice is allowed."""
        self._words.release()
        self.memory.close()
        self._close_fd()


def _open(path: Path) -> int:
    # No link: root may give a command to a service that could make it write to any file else.
    flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
    try:
        return os.open(path, flags, 0o660)
    except OSError as error:
        raise SpaceUnavailable(
            f"{path}: cannot open shared memory: {error.strerror}; "
            "is the run still up, and does this user own it?"
        ) from error


def _is_laid_out(fd: int, topic: Topic[Any], layout: SlotLayout) -> bool:
    """Return whether the file is as expected; its header is written last."""
    is_whole = os.fstat(fd).st_size == layout.file_bytes
    return is_whole and _header(fd) == _expected_header(topic, layout)


def _expected_header(topic: Topic[Any], layout: SlotLayout) -> tuple[object, ...]:
    return (_MAGIC, VERSION, schema_hash(topic), layout.file_bytes, _boot_id())


def _header(fd: int) -> tuple[Any, ...]:
    return _HEADER.unpack(os.pread(fd, _HEADER.size, 0).ljust(_HEADER.size, b"\0"))


def _create_or_check(fd: int, path: Path, topic: Topic[Any], layout: SlotLayout) -> None:
    expected, found = _expected_header(topic, layout), _header(fd)
    # A blank header is a creator that was killed; another boot's file has no living writer.
    if found[0] == bytes(len(_MAGIC)) or found[4] != expected[4]:
        _create(fd, path, layout, _HEADER.pack(*expected))
    elif found != expected or os.fstat(fd).st_size != layout.file_bytes:
        raise SchemaMismatch(
            f"{path}: topic {topic.name} was laid out by another version "
            f"(schema {found[2]:08x}, {found[3]} bytes; expected {expected[2]:08x}, {expected[3]} "
            "bytes); stop every process of this run and start it again"
        )


def _create(fd: int, path: Path, layout: SlotLayout, header: bytes) -> None:
    os.ftruncate(fd, 0)
    try:
        # Memory is reserved now: a full /dev/shm must fail here, not as SIGBUS in the control loop.
        if path.parent.stat().st_dev == _SHM.stat().st_dev:
            os.posix_fallocate(fd, 0, layout.file_bytes)
        os.ftruncate(fd, layout.file_bytes)
    except OSError as error:
        os.ftruncate(fd, 0)
        wanted = f"{layout.file_bytes} bytes of shared memory"
        reason = "no space left" if error.errno == errno.ENOSPC else error.strerror
        raise SpaceUnavailable(f"{path}: {reason} for {wanted}; see `df /dev/shm`") from error
    os.pwrite(fd, header, 0)


def _boot_id() -> bytes:
    return Path("/proc/sys/kernel/random/boot_id").read_bytes().strip()[:36]
