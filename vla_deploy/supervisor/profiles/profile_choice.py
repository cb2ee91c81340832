"""Keep which profile a person has chosen, for the next start."""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from platforms import ProfileError, load_profile
from platforms.board import identify
from vla_deploy.runtime.one_line import one_line
from vla_deploy.runtime.state_dir import library_dir_of
from vla_deploy.supervisor.runs.runtime import default_base

_NAME: Final = "profile.json"
_FALLBACK: Final = "desktop"
_MOST_CHARACTERS: Final = 500


@dataclass(frozen=True, slots=True, kw_only=True)
class StartProfile:
    """Name the profile that a start takes, and why; `fault` is why it is not the chosen one."""

    name: str
    why: str
    fault: str = ""


class ProfileChoice:
    """Keep the chosen profile in a small file; the old choice stays until the new one is whole."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def load(self) -> str | None:
        """Return the chosen profile; None when none is, or what is there cannot be read."""
        try:
            chosen = json.loads(self.path.read_text())["profile"]
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return chosen if isinstance(chosen, str) else None

    def save(self, profile: str) -> None:
        """Choose a profile.

        Raises:
            OSError: the file cannot be written.
        """
        self.path.parent.mkdir(parents=True, exist_ok=True)
        fresh = self.path.with_name(f".{self.path.name}-{os.getpid()}")
        fresh.write_text(json.dumps({"profile": profile}) + "\n")
        with fresh.open("rb") as written:
            os.fsync(written.fileno())
        fresh.replace(self.path)


def choice_of(runtime_base: Path | None) -> ProfileChoice:
    """Return where the choice for the runs of a runtime directory is kept."""
    return ProfileChoice(library_dir_of(runtime_base or default_base()) / _NAME)


def start_profile(runtime_base: Path | None, root: Path = Path("/")) -> StartProfile:
    """Return the profile to start with when none is given.

    A chosen one that no longer loads, as after its file or its release was removed, does not keep
    the robot down: the detected one is taken, with the fault. The choice stays as it is.
    """
    name, why = detect(root)
    chosen = choice_of(runtime_base).load()
    if chosen is None:
        return StartProfile(name=name, why=why)
    try:
        load_profile(chosen)
    except ProfileError as error:
        fault = f"the chosen profile {chosen} does not load: {'; '.join(error.faults)}"
        return StartProfile(name=name, why=why, fault=one_line(fault)[:_MOST_CHARACTERS])
    return StartProfile(name=chosen, why="chosen by: vla-deploy profile use")


def detect(root: Path = Path("/")) -> tuple[str, str]:
    """Return the profile made for this computer, and why."""
    board = identify(root)
    reasons = "; ".join(board.reasons)
    if board.profile_name is None:
        return _FALLBACK, f"{board.name} is not known: {reasons}"
    return board.profile_name, f"{board.name}" + (f": {reasons}" if reasons else "")
