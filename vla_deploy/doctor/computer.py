"""Tell which computer this is, and whether the profile fits it."""

import os
from collections.abc import Iterator

from platforms.tree import ValueMissing
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, fail, ok, warn

_GB = 1e9
_MB = 1e6


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
    """Report whose rights are examined: the service has its own user."""
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
