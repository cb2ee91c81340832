"""Read what control groups this kernel has, and what ours uses."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from platforms.probes.reading import Reading, measure
from platforms.tree import Tree, ValueMissing, number_in

MOUNT: Final = "/sys/fs/cgroup"
UNIFIED: Final = f"{MOUNT}/unified"  # where both versions live side by side
_PREFIX: Final = "0::"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cgroup:
    """Describe our control group; `version` is 2, 1 for the old kind, 0 for none.

    `folder` is that of version 2, `controllers` what may limit us there.
    """

    version: int
    folder: str
    controllers: tuple[str, ...]
    reason: str = ""


def read_cgroup(tree: Tree) -> Cgroup:
    """Return our control group; never fails."""
    try:
        lines = tree.text("/proc/self/cgroup").splitlines()
    except ValueMissing as missing:
        return Cgroup(version=0, folder="", controllers=(), reason=str(missing))
    path = next((line[len(_PREFIX) :] for line in lines if line.startswith(_PREFIX)), None)
    mount = UNIFIED if tree.exists(f"{UNIFIED}/cgroup.controllers") else MOUNT
    old = any(not line.startswith(_PREFIX) for line in lines)
    if path is None or not tree.exists(f"{mount}/cgroup.controllers"):
        reason = f"there is no {MOUNT}/cgroup.controllers"
        return Cgroup(version=1 if old else 0, folder="", controllers=(), reason=reason)
    folder = f"{mount}/{path.strip('/')}".rstrip("/")
    try:
        controllers = tuple(tree.text(f"{folder}/cgroup.controllers").split())
    except ValueMissing as missing:
        return Cgroup(version=2, folder=folder, controllers=(), reason=str(missing))
    reason = "version 1 holds the other controllers" if old else ""
    return Cgroup(version=2, folder=folder, controllers=controllers, reason=reason)


class CgroupSource:
    """Read what our control group uses and how often it was held back."""

    def __init__(self, tree: Tree) -> None:
        self._tree = tree
        self._cgroup = read_cgroup(tree)
        self._memory = tree.file(f"{self._cgroup.folder}/memory.current")
        self._limit = tree.file(f"{self._cgroup.folder}/memory.max")
        self._cpu = tree.file(f"{self._cgroup.folder}/cpu.stat")

    def readings(self) -> Iterator[Reading]:
        """Return memory, its limit, and the time for which we were held back."""
        yield measure("cgroup_memory_bytes", "bytes", lambda: self._known(self._memory.number))
        yield measure("cgroup_memory_limit_bytes", "bytes", lambda: self._known(self._limit_bytes))
        yield measure("cgroup_throttled_s", "s", lambda: self._known(self._throttled_s))

    def _known(self, take: Callable[[], float]) -> float:
        if not self._cgroup.folder:
            raise ValueMissing(self._cgroup.reason)
        return take()

    def _limit_bytes(self) -> float:
        if self._limit.text() == "max":
            raise ValueMissing("our control group has no memory limit")
        return self._limit.number()

    def _throttled_s(self) -> float:
        for line in self._cpu.text().splitlines():
            key, _, value = line.partition(" ")
            if key == "throttled_usec":
                return number_in(value, str(self._cpu)) * 1e-6
        raise ValueMissing(f"{self._cpu} counts no throttled_usec")
