"""Find the profile that the service starts with, and whether another one fits into its slice."""

import re
from pathlib import Path
from typing import Final

from platforms import Profile
from vla_deploy.install.layout import SERVICE_RUNTIME, InstallLayout
from vla_deploy.supervisor.profiles.profile_choice import (
    ProfileChoice,
    StartProfile,
    choice_of,
    detect,
    start_profile,
)

_SLICE: Final = Path("/etc/systemd/system/vla-deploy.slice")
_MEMORY_HIGH: Final = re.compile(r"^MemoryHigh=(\d+)M$", re.MULTILINE)


def service_profile(given: str, layout: InstallLayout) -> StartProfile:
    """Return the given profile, else the chosen one, else the one detected, and why."""
    if given:
        return StartProfile(name=given, why="given by --profile")
    if layout.is_this_computer:
        return start_profile(SERVICE_RUNTIME)
    chosen = ProfileChoice(layout.on_disk(choice_of(SERVICE_RUNTIME).path)).load()
    if chosen is None:
        name, why = detect(layout.root)
        return StartProfile(name=name, why=why)
    inside = str(layout.on_disk(Path(chosen))) if chosen.startswith("/") else chosen
    return StartProfile(name=inside, why=f"chosen in {layout.root}")


def slice_too_small(profile: Profile, layout: InstallLayout) -> str:
    """Return why the installed slice does not hold a profile's memory; "" where it does."""
    file = layout.on_disk(_SLICE)
    limit = _MEMORY_HIGH.search(file.read_text(errors="replace")) if file.is_file() else None
    if limit is None or profile.total.memory_mb <= int(limit[1]):
        return ""
    return (
        f"profile {profile.name} may use {profile.total.memory_mb:.0f} MB, the installed slice "
        f"allows {limit[1]} MB ({file}); install again to size it: sudo vla-deploy install"
    )
