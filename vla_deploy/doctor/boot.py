"""Say how an option gets onto the kernel's command line."""

from typing import Final

from platforms.tree import Tree

_EXTLINUX: Final = "/boot/extlinux/extlinux.conf"


def boot_option(tree: Tree, option: str) -> str:
    """Return the command to type: Jetsons boot by extlinux, most others by GRUB."""
    if tree.exists(_EXTLINUX):
        return f"sudoedit {_EXTLINUX}   # add {option} to APPEND; reboot"
    return f"sudoedit /etc/default/grub   # add {option}; sudo update-grub; reboot"
