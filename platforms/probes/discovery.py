"""Find devices in a folder of the kernel, and again when others appear."""

from collections.abc import Callable, Sized
from typing import Generic, TypeVar

from platforms.tree import Tree, ValueMissing

Found = TypeVar("Found", bound=Sized)


class Discovery(Generic[Found]):
    """Keep what was found in a folder until its entries change, and look anew while it is nothing.

    A device may appear long after boot: the GPU does, on some releases.
    """

    def __init__(self, tree: Tree, folder: str, find: Callable[[tuple[str, ...]], Found]) -> None:
        self._tree, self._folder, self._find = tree, folder, find
        self._names: tuple[str, ...] | None = None
        self._found: Found | None = None

    def current(self) -> Found:
        """Return what there is now."""
        names = self._tree.names(self._folder)
        if names != self._names or not self._found:
            self._tree.close(below=f"{self._folder}/")
            self._names, self._found = names, self._find(names)
        return self._found


class Hwmon:
    """Group the folders below /sys/class/hwmon by the name of their chip."""

    FOLDER = "/sys/class/hwmon"

    def __init__(self, tree: Tree) -> None:
        self._tree = tree
        self._discovery = Discovery(tree, self.FOLDER, self._find)

    def chips(self) -> dict[str, tuple[str, ...]]:
        """Return the folders of each chip name."""
        return self._discovery.current()

    def _find(self, names: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
        chips: dict[str, tuple[str, ...]] = {}
        for name in names:
            folder = f"{self.FOLDER}/{name}"
            try:
                chip = self._tree.text(f"{folder}/name")
            except ValueMissing:
                continue
            chips[chip] = (*chips.get(chip, ()), folder)
        return chips
