"""Find the folders that outlive a run: logs, configuration, models, what was built from models."""

import os
from pathlib import Path
from typing import Final

_ROOT_BASE: Final = Path("/run/vla-deploy")
ROOT_STATE: Final = Path("/var/log/vla-deploy")
ROOT_CONFIG: Final = Path("/etc/vla-deploy")
_ROOT_LIBRARY: Final = Path("/var/lib/vla-deploy")
_MODELS: Final = "models"
_ENGINES: Final = "engines"
_ACCESS: Final = "access"


def state_dir_of(base: Path) -> Path:
    """Return where the runs of a runtime directory leave what outlives them."""
    if base == _ROOT_BASE:
        return ROOT_STATE
    if base == user_base():
        home = os.environ.get("XDG_STATE_HOME")
        return (Path(home) if home else Path.home() / ".local" / "state") / "vla-deploy"
    return base.with_name(f"{base.name}-state")


def config_dir_of(base: Path) -> Path:
    """Return where a person keeps what concerns this robot alone, such as its model servers."""
    if base == _ROOT_BASE:
        return ROOT_CONFIG
    if base == user_base():
        home = os.environ.get("XDG_CONFIG_HOME")
        return (Path(home) if home else Path.home() / ".config") / "vla-deploy"
    return base.with_name(f"{base.name}-config")


def models_dir_of(base: Path) -> Path:
    """Return where the models lie that a person has added."""
    return library_dir_of(base) / _MODELS


def system_models_dir() -> Path:
    """Return where the models lie that root has added, for the service of this computer."""
    return _ROOT_LIBRARY / _MODELS


def engines_dir_of(base: Path) -> Path:
    """Return where execution providers keep what they build from models; it may be deleted."""
    return library_dir_of(base) / _ENGINES


def access_dir_of(base: Path) -> Path:
    """Return where the dashboard's accounts lie, and what was done through it."""
    return library_dir_of(base) / _ACCESS


def user_base() -> Path:
    """Return where runs of a user who is not root live unless told otherwise."""
    user_runtime = os.environ.get("XDG_RUNTIME_DIR")
    return (
        Path(user_runtime) / "vla-deploy"
        if user_runtime
        else Path(f"/tmp/vla-deploy-{os.getuid()}")
    )


def library_dir_of(base: Path) -> Path:
    """Return where what grows with use is kept: models, recordings."""
    return _ROOT_LIBRARY if base == _ROOT_BASE else state_dir_of(base)
