"""Find the keys of servers, and keep them out of everything that is printed."""

import os
import re
import stat
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from vla_deploy.model_servers.errors import CredentialMissing
from vla_deploy.runtime.secret import Secret
from vla_deploy.runtime.state_dir import config_dir_of

FOLDER_VARIABLE: Final = "CREDENTIALS_DIRECTORY"
"""systemd names in it the folder with what `LoadCredential=` gave to the service."""
OWN_FOLDER: Final = "credentials"
"""Beside servers.toml: one file for each key."""
GIVEN_FOLDER: Final = "with_parameters/credentials"
"""In the runtime directory: what a start gave, as by ROS parameters."""
_FOR_OTHERS: Final = 0o007  # systemd gives its files to the service by its group
_KEY: Final = re.compile(r"[\x21-\x7e]{1,4096}")


def key_folders(base: Path, environment: Mapping[str, str] = os.environ) -> tuple[Path, ...]:
    """Return where keys are looked for by a run in a runtime directory, in this order.

    Not in the environment: every process of the robot inherits that.
    """
    systemds = environment.get(FOLDER_VARIABLE)
    own = (config_dir_of(base) / OWN_FOLDER, base / GIVEN_FOLDER)
    return (Path(systemds), *own) if systemds else own


def find_credential(name: str, folders: Sequence[Path]) -> Secret:
    """Return a key: the file `name` in the first of the folders that has it.

    Raises:
        CredentialMissing: none has it, others may read it, or it is not one word of printable
            ASCII.
    """
    for file in (folder / name for folder in folders):
        if file.is_file():
            return _checked(_read(file), f"credential {name}")
    where = ", ".join(str(folder / name) for folder in folders)
    raise CredentialMissing(
        f"no key {name}: expected one word in a file of mode 600: {where}; for the service: "
        f"vla-deploy install --credential {name}=FILE"
    )


def _read(file: Path) -> str:
    try:
        mode = stat.S_IMODE(file.stat().st_mode)
        if mode & _FOR_OTHERS:
            raise CredentialMissing(
                f"{file}: others may read the key (mode {mode:o}), expected: chmod 600 {file}"
            )
        return file.read_text(encoding="ascii")
    except OSError as error:
        raise CredentialMissing(f"{file}: cannot read the key: {error.strerror}") from error
    except UnicodeDecodeError:
        # Without its cause: that would show the bytes.
        raise CredentialMissing(f"{file}: expected a key of printable ASCII") from None


def _checked(text: str, where: str) -> Secret:
    key = text.strip()
    if not _KEY.fullmatch(key):
        raise CredentialMissing(
            f"{where}: expected one word of 1 to 4096 printable ASCII characters, "
            f"got {len(key)} characters that are not"
        )
    return Secret(key)
