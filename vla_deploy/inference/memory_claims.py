"""Claim the memory of models before they are loaded, where a run declares how much there is."""

import itertools
import logging
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from math import ceil
from pathlib import Path
from typing import Final, Protocol, TypeVar

from drivers.clock import Clock
from platforms import ModelChoice
from vla_deploy.inference.errors import MemoryRefused
from vla_deploy.inference.providers import CPU
from vla_deploy.inference.runtime import available_providers
from vla_deploy.inference.store import StoredModel
from vla_deploy.ipc import ClaimBook, ClaimRefused, IpcError, SharedSpace

RAM: Final = "ram_mb"
GPU_MEMORY: Final = "gpu_memory_mb"
_MB: Final = 1_000_000
_BYTES_PER_RESIDENT_MB: Final = 2**20
_PAGE_BYTES: Final = os.sysconf("SC_PAGE_SIZE")
_numbers = itertools.count(1)
_log = logging.getLogger(__name__)


class MemoryClaim:
    """Give back what was claimed for one model, once; without a claim, nothing."""

    def __init__(self, release: Callable[[], None] | None = None) -> None:
        self._release = release

    def release(self) -> None:
        """Give it back; a second time is allowed."""
        release, self._release = self._release, None
        if release is not None:
            release()


class Loaded(Protocol):
    """Hold a model, and release its claim when it is closed."""

    claim: MemoryClaim


LoadedT = TypeVar("LoadedT", bound=Loaded)


class RunMemory:
    """Claim memory in one run, from any thread; the shared claims are opened for each change."""

    def __init__(self, ipc: Path, clock: Clock) -> None:
        self._ipc = ipc
        self._clock = clock

    def load(self, model: StoredModel, choice: ModelChoice, load: Callable[[], LoadedT]) -> LoadedT:
        """Claim what a model declares by the size of its weights, load it, claim what it took.

        Nobody waits here: what holds the memory gives it back when it likes, and a robot can go on
        with a smaller model, or the one it has. A claim ends with the process, however it ends.

        Raises:
            MemoryRefused: others hold what it needs; says who.
        """
        manifest = model.manifest
        holder = f"{manifest.role} {manifest.name} {os.getpid()}.{next(_numbers)}"
        wants = self._claim(holder, _needs(model, choice))
        if not wants:
            return load()
        before_mb = resident_mb()
        try:
            loaded = load()
        except BaseException:
            self._release(holder)
            raise
        took_mb = (resident_mb() - before_mb) * _BYTES_PER_RESIDENT_MB / _MB
        self._amend(holder, {**wants, RAM: max(1, ceil(took_mb))})
        loaded.claim = MemoryClaim(partial(self._release, holder))
        return loaded

    def _claim(self, holder: str, needs: dict[str, int]) -> dict[str, int]:
        """Return what was claimed of what the run declares; nothing where it declares nothing."""
        try:
            with self._book() as book:
                declared = book.look().capacities
                wants = {name: amount for name, amount in needs.items() if name in declared}
                if not wants or book.ask(holder, wants):
                    return wants
                book.release(holder)
                why = book.obstacles(wants)
        except ClaimRefused as error:
            raise MemoryRefused(_refusal(str(error))) from error
        except IpcError as error:
            _log.warning("degraded: memory of %s is not claimed: %s", holder, error)
            return {}
        amounts = ", ".join(f"{amount} of {name}" for name, amount in wants.items())
        raise MemoryRefused(_refusal(f"{holder} needs {amounts}, but {why}"))

    def _amend(self, holder: str, wants: dict[str, int]) -> None:
        try:
            with self._book() as book:
                book.amend(holder, wants)
        except IpcError as error:
            _log.warning("the claim of %s stays as it was declared: %s", holder, error)

    def _release(self, holder: str) -> None:
        if not self._ipc.is_dir():
            return  # the run is over, and its claims with it
        try:
            with self._book() as book:
                book.release(holder)
        except IpcError as error:
            _log.warning("the claim of %s stays until this process ends: %s", holder, error)

    @contextmanager
    def _book(self) -> Iterator[ClaimBook]:
        space = SharedSpace(self._ipc, self._clock)
        try:
            yield ClaimBook(space, self._clock)
        finally:
            space.close()


def resident_mb() -> float:
    """Return how much memory this process holds."""
    resident_pages = int(Path("/proc/self/statm").read_text().split()[1])
    return resident_pages * _PAGE_BYTES / _BYTES_PER_RESIDENT_MB


def _needs(model: StoredModel, choice: ModelChoice) -> dict[str, int]:
    """Return what the largest file takes: weights are held as they lie on the disk, or as one."""
    largest_bytes = max(path.stat().st_size for path in model.folder.rglob("*") if path.is_file())
    amount = max(1, ceil(largest_bytes / _MB))
    on_gpu = any(one != CPU and one in available_providers() for one in choice.providers)
    return {RAM: amount, GPU_MEMORY: amount} if on_gpu else {RAM: amount}


def _refusal(why: str) -> str:
    return f"{why}; choose a smaller model, or raise budgets.total in the profile"
