"""Keep the token by which programs of the robot's user ask the dashboard, in a file of mode 600."""

import os
import stat
from pathlib import Path
from typing import Final

from vla_deploy.client.access.accounts import (
    Accounts,
    AccountsFile,
    UserRole,
    new_token,
    wall_s,
)
from vla_deploy.client.access.errors import AccessError, LocalTokenUnusable
from vla_deploy.client.access.private_file import open_private
from vla_deploy.runtime.state_dir import access_dir_of

LOCAL: Final = "local"
"""The name of the token among the others: `vla-deploy dashboard token revoke local` ends it."""
TOKEN_FILE: Final = "local_token"
_MOST_BYTES: Final = 256


def local_headers(base: Path) -> dict[str, str]:
    """Return the HTTP headers by which a program of the robot's user is an admin.

    Raises:
        LocalTokenUnusable: there is no token yet, or others may read it.
    """
    return {"Authorization": f"Bearer {_read(base)}"}


def provide_local_token(base: Path, accounts: AccountsFile) -> None:
    """Make the token if there is none that counts.

    Raises:
        AccessError: the accounts cannot be used.
        OSError: the token's file cannot be written.
    """
    if _counts(base, accounts.read()):
        return
    token_id, text, token = new_token(LOCAL, UserRole.ADMIN, wall_s(), lasts_s=None)

    def replaced(held: Accounts) -> tuple[Accounts, None]:
        others = held if held.token_named(LOCAL) is None else held.without_token(LOCAL)
        return others.with_token(token_id, token), None

    file = _file_of(base)
    file.unlink(missing_ok=True)
    handle = open_private(file, os.O_WRONLY | os.O_EXCL)
    try:
        os.write(handle, f"{text}\n".encode())
    finally:
        os.close(handle)
    accounts.change(replaced)


def _counts(base: Path, held: Accounts) -> bool:
    try:
        token = held.token_of(_read(base), wall_s())
    except AccessError:
        return False
    return token is not None and token.name == LOCAL


def _read(base: Path) -> str:
    file = _file_of(base)
    try:
        handle = os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError as error:
        raise LocalTokenUnusable(
            f"{file}: {error.strerror}; run as the robot's user or as root, while it runs"
        ) from error
    try:
        found = os.fstat(handle)
        mode = stat.S_IMODE(found.st_mode)
        if os.geteuid() not in (0, found.st_uid):
            raise LocalTokenUnusable(f"{file}: belongs to user {found.st_uid}; remove it")
        if mode & 0o077:
            raise LocalTokenUnusable(
                f"{file}: others may read it (mode {mode:o}), expected 600; revoke it: "
                f"vla-deploy dashboard token revoke {LOCAL}; then start the robot again"
            )
        return os.read(handle, _MOST_BYTES).decode(errors="replace").strip()
    finally:
        os.close(handle)


def _file_of(base: Path) -> Path:
    return access_dir_of(base) / TOKEN_FILE
