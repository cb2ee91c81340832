"""Read user and password of a broker or a device from a file that only its owner can read."""

import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from vla_deploy.devices.errors import DeviceNotUsable
from vla_deploy.runtime.secret import Secret
from vla_deploy.runtime.table_schema import parse_toml

_OTHERS: Final = stat.S_IRWXG | stat.S_IRWXO
_EXAMPLE: Final = 'two lines, user = "robot" and password = "..."'


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceLogin:
    """Hold a user's name and password."""

    user: str
    password: Secret


def read_login(file: Path) -> DeviceLogin:
    """Return what a credentials file holds.

    Raises:
        DeviceNotUsable: it is missing, others may read it, or it holds something else.
    """
    try:
        mode = file.stat().st_mode
        if mode & _OTHERS:
            raise DeviceNotUsable(
                f"{file}: mode {stat.S_IMODE(mode):o} lets others read it, expected 600; "
                f"try: chmod 600 {file}"
            )
        document = parse_toml(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise DeviceNotUsable(f"{file}: {error.strerror}; expected {_EXAMPLE}") from error
    except ValueError:
        # Without its cause: that would show what stands in the file.
        raise DeviceNotUsable(f"{file}: not TOML; expected {_EXAMPLE}") from None
    user, password = document.get("user"), document.get("password")
    if not (isinstance(user, str) and isinstance(password, str) and user and password):
        raise DeviceNotUsable(f"{file}: expected {_EXAMPLE}")
    return DeviceLogin(user=user, password=Secret(password))
