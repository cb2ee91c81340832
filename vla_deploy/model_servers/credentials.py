"""Find the keys of servers, and keep them out of everything that is printed."""

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from vla_deploy.model_servers.errors import CredentialMissing
from vla_deploy.runtime.secret import Secret

FOLDER_VARIABLE: Final = "CREDENTIALS_DIRECTORY"
"""systemd names in it the folder with what `LoadCredential=` gave to the service."""
_KEY: Final = re.compile(r"[\x21-\x7e]{1,4096}")


def find_credential(name: str, environment: Mapping[str, str] = os.environ) -> Secret:
    """Return a key: the file `name` among systemd's credentials, else the variable `NAME`.

    Raises:
        CredentialMissing: it is in neither place, or is not one word of printable ASCII.
    """
    folder = environment.get(FOLDER_VARIABLE)
    file = Path(folder) / name if folder else None
    variable = name.upper()
    if file is not None and file.is_file():
        return _checked(_read(file), f"credential {name}")
    if variable in environment:
        return _checked(environment[variable], f"environment variable {variable}")
    where = f"{file} and " if file else ""
    raise CredentialMissing(
        f"no key {name}: expected one in {where}environment variable {variable}; for the service: "
        f"vla-deploy install --credential {name}=FILE"
    )


def _read(file: Path) -> str:
    try:
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
