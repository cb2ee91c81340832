"""Find out which computer this is, by what its kernel and its release file tell."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from platforms.tree import Tree, ValueMissing

GIB: Final = 1 << 30
_MODULE: Final = re.compile(r"\bp(?:3767|3701|3834)-\d{4}\b")
_PRODUCT: Final = ("sys_vendor", "product_name")
_RELEASE: Final = re.compile(r"#\s*R(\d+)\b.*?REVISION:\s*(\d+(?:\.\d+)*)")


@dataclass(frozen=True, slots=True, kw_only=True)
class Module:
    """Name one module and the profile made for it; some gain a second one by their Super modes."""

    name: str
    profile: str
    super_profile: str | None = None


NANO_8 = Module(
    name="Jetson Orin Nano 8 GB",
    profile="jetson_orin_nano_8gb",
    super_profile="jetson_orin_nano_8gb_super",
)
MODULES: Mapping[str, Module] = {
    "p3767-0000": Module(name="Jetson Orin NX 16 GB", profile="jetson_orin_nx"),
    "p3767-0001": Module(name="Jetson Orin NX 8 GB", profile="jetson_orin_nx"),
    "p3767-0003": NANO_8,
    "p3767-0004": Module(name="Jetson Orin Nano 4 GB", profile="jetson_orin_nano_4gb"),
    "p3767-0005": NANO_8,  # the developer kit's
    "p3701-0000": Module(name="Jetson AGX Orin developer kit", profile="jetson_agx_orin"),
    "p3701-0004": Module(name="Jetson AGX Orin 32 GB", profile="jetson_agx_orin"),
    "p3701-0005": Module(name="Jetson AGX Orin 64 GB", profile="jetson_agx_orin"),
    "p3834-0000": Module(name="Jetson Thor T4000", profile="jetson_thor"),
    "p3834-0008": Module(name="Jetson Thor T5000", profile="jetson_thor"),
}
# Chip, memory below which, profile: for a module that the table above does not know.
BY_CHIP: tuple[tuple[str, float, str], ...] = (
    ("tegra234", 5, "jetson_orin_nano_4gb"),
    ("tegra234", 9, "jetson_orin_nano_8gb"),
    ("tegra234", 17, "jetson_orin_nx"),
    ("tegra234", float("inf"), "jetson_agx_orin"),
    ("tegra264", float("inf"), "jetson_thor"),
)
JETPACKS: Mapping[str, str] = {
    "36.4.3": "6.2",
    "36.4.4": "6.2.1",
    "36.4.7": "6.2.1",
    "36.5.0": "6.2.2",
    "38.2.0": "7.0",
    "38.2.1": "7.0",
    "38.2.2": "7.0",
    "38.4.0": "7.1",
    "39.2.0": "7.2",
    "39.2.1": "7.2.1",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """Describe this computer; what could not be found out is None, and `reasons` say why.

    `module` is the part number, `l4t` the release of the board's Linux. `is_super` means that the
    Super power modes are there. `profile_name` is the profile made for it, if there is one.
    """

    name: str
    module: str | None
    memory_bytes: int | None
    l4t: str | None
    jetpack: str | None
    is_super: bool
    profile_name: str | None
    reasons: tuple[str, ...]


def identify(root: Path = Path("/")) -> Board:
    """Return which computer has this root; never fails."""
    tree, reasons = Tree(root), list[str]()
    model = _device_tree(tree, "model", reasons)
    compatible = _device_tree(tree, "compatible", reasons)
    memory_bytes = _memory_bytes(tree, reasons)
    found = _MODULE.search(compatible)
    module = found.group() if found else None
    l4t = _l4t(tree, reasons)
    is_super = _is_super(tree, model, compatible)
    known = MODULES.get(module or "")
    return Board(
        name=model.replace("\0", " ") or (known.name if known else _product(tree)),
        module=module,
        memory_bytes=memory_bytes,
        l4t=l4t,
        jetpack=_jetpack(l4t, reasons),
        is_super=is_super,
        profile_name=_profile(known, is_super, model, compatible, memory_bytes, reasons),
        reasons=tuple(reasons),
    )


def _device_tree(tree: Tree, name: str, reasons: list[str]) -> str:
    tried = ("/proc/device-tree", "/sys/firmware/devicetree/base")
    for folder in tried:
        try:
            return tree.text(f"{folder}/{name}")
        except ValueMissing as missing:
            reason = f"{name} of the board is missing, because {missing}"
    reasons.append(reason)
    return ""


def _product(tree: Tree) -> str:
    """Return the name that the firmware of a PC tells."""
    try:
        vendor, product = (tree.text(f"/sys/class/dmi/id/{key}") for key in _PRODUCT)
    except ValueMissing:
        return "computer without device tree"
    return f"{vendor} {product}"


def _memory_bytes(tree: Tree, reasons: list[str]) -> int | None:
    try:
        text = tree.text("/proc/meminfo")
    except ValueMissing as missing:
        reasons.append(f"the memory's size is missing, because {missing}")
        return None
    found = re.search(r"^MemTotal:\s+(\d{1,15}) kB", text, re.MULTILINE)
    if found is None:
        reasons.append("the memory's size is missing, because /proc/meminfo has no MemTotal")
        return None
    return int(found.group(1)) * 1024


def _l4t(tree: Tree, reasons: list[str]) -> str | None:
    try:
        found = _RELEASE.search(tree.text("/etc/nv_tegra_release"))
    except ValueMissing as missing:
        reasons.append(f"the L4T release is missing, because {missing}")
        return None
    if found is None:
        reasons.append("the L4T release is missing, because /etc/nv_tegra_release tells none")
        return None
    return f"{found.group(1)}.{found.group(2)}"


def _jetpack(l4t: str | None, reasons: list[str]) -> str | None:
    if l4t is None:
        return None
    if l4t not in JETPACKS:
        reasons.append(f"the JetPack release of L4T {l4t} is not known here")
    return JETPACKS.get(l4t)


def _is_super(tree: Tree, model: str, compatible: str) -> bool:
    if "super" in f"{model} {compatible}".lower():
        return True
    try:
        return "MAXN_SUPER" in tree.text("/etc/nvpmodel.conf")
    except ValueMissing:
        return False


def _profile(
    known: Module | None,
    is_super: bool,
    model: str,
    compatible: str,
    memory_bytes: int | None,
    reasons: list[str],
) -> str | None:
    if known is not None:
        return (is_super and known.super_profile) or known.profile
    if not compatible and not model:
        reasons.append("no device tree: taken for a desktop")
        return "desktop"
    for profile in _of_chip(compatible, memory_bytes):
        reasons.append(f"unknown module of a known chip: {profile} chosen by its memory")
        return profile
    reasons.append(f"no profile is made for {model!r}: try desktop, or write one that inherits it")
    return None


def _of_chip(compatible: str, memory_bytes: int | None) -> Iterator[str]:
    if memory_bytes is None:
        return
    for chip, below_gib, profile in BY_CHIP:
        if chip in compatible and memory_bytes < below_gib * GIB:
            yield profile
