"""Keep accounts in one file that only its owner may read; change it in turns."""

import contextlib
import json
import os
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, TypeVar

from pydantic import ValidationError

from vla_deploy.dashboard.access.accounts import Accounts
from vla_deploy.dashboard.access.errors import AccountsUnusable
from vla_deploy.dashboard.access.private_file import give, turn
from vla_deploy.runtime.state_dir import access_dir_of

FILE_NAME: Final = "accounts.json"
_MOST_BYTES: Final = 2**20
T = TypeVar("T")


class AccountsFile:
    """Read and change the accounts of one robot; several processes may hold one."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._seen: tuple[int, ...] = ()
        self._accounts = Accounts()

    @classmethod
    def of_base(cls, base: Path) -> "AccountsFile":
        """Return the accounts of the robot that runs in a runtime directory."""
        return cls(access_dir_of(base) / FILE_NAME)

    def read(self) -> Accounts:
        """Return the accounts; the file is read again only when it has changed.

        Raises:
            AccountsUnusable: it cannot be read, others may read it, or it has faults.
        """
        with self._told():
            try:
                found = self.path.stat()
            except FileNotFoundError:
                self._seen, self._accounts = (), Accounts()
                return self._accounts
            now = (found.st_ino, found.st_mtime_ns, found.st_size, found.st_mode)
            if now != self._seen:
                _check(self.path, found)
                self._accounts = _parse(self.path)
                self._seen = now
            return self._accounts

    def change(self, act: Callable[[Accounts], tuple[Accounts, T]]) -> T:
        """Replace the accounts by what `act` makes of them, and return what else it returns.

        Raises:
            AccountsUnusable: the file cannot be read or written; it is as it was.
        """
        with self._told(), turn(self.path.with_suffix(".lock")):
            accounts, told = act(self.read())
            _write(self.path, accounts)
            return told

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise AccountsUnusable(
                f"{self.path}: {error.strerror}; run as the robot's user, or as root"
            ) from error


def _check(path: Path, found: os.stat_result) -> None:
    if found.st_mode & 0o077:
        raise AccountsUnusable(
            f"{path}: others may read or write it (mode {stat.S_IMODE(found.st_mode):o}), expected "
            f"600: `chmod 600 {path}`, and new passwords if they may have been read"
        )
    if found.st_size > _MOST_BYTES:
        raise AccountsUnusable(f"{path}: {found.st_size} bytes, expected at most {_MOST_BYTES}")


def _parse(path: Path) -> Accounts:
    try:
        return Accounts.model_validate_json(path.read_bytes())
    except ValidationError as error:
        faults = error.errors(include_url=False, include_input=False)  # the input is secret
        told = "; ".join(f"{'.'.join(map(str, one['loc']))}: {one['msg']}" for one in faults[:8])
        raise AccountsUnusable(
            f"{path}: {told}; mend it, or delete it and set passwords anew"
        ) from None


def _write(path: Path, accounts: Accounts) -> None:
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".accounts-")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            give(file.fileno(), path.parent)
            file.write(json.dumps(accounts.model_dump(mode="json"), indent=1))
            file.flush()
            os.fsync(file.fileno())
        Path(name).replace(path)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            Path(name).unlink()
        raise
