"""Keep users and tokens in one file that only its owner may read."""

import contextlib
import hashlib
import hmac
import json
import os
import re
import secrets
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Final, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from vla_deploy.client.access.errors import AccountRefused, AccountsUnusable
from vla_deploy.client.access.passwords import is_password_hash
from vla_deploy.client.access.private_file import give, turn
from vla_deploy.runtime.state_dir import access_dir_of

NAME_PATTERN: Final = r"^[a-z][a-z0-9_-]{0,31}$"
MOST_USERS: Final = 64
MOST_TOKENS: Final = 256
_TOKEN: Final = re.compile(r"vla_([0-9a-f]{8})_([0-9a-f]{64})")
_ID_BYTES: Final = 4
_SECRET_BYTES: Final = 32
# A clock that is set back by more than this cannot judge what has expired.
CLOCK_SLACK_S: Final = 600.0
Name = Annotated[str, Field(pattern=NAME_PATTERN)]
_STRICT: Final = ConfigDict(extra="forbid", frozen=True, strict=True)
ACCOUNTS_FILE: Final = "accounts.json"
_MOST_BYTES: Final = 2**20
T = TypeVar("T")


class UserRole(StrEnum):
    """Name what a user may do; each role includes the roles before it."""

    ANYONE = "anyone"
    """Without a login: press stop, log in."""
    VIEWER = "viewer"
    """See everything: state, camera, map, logs, recordings."""
    OPERATOR = "operator"
    """Give commands, reset, arm, disarm, acknowledge, record."""
    ADMIN = "admin"
    """Change the profile, read the audit log."""

    def allows(self, needed: "UserRole") -> bool:
        """Return whether this role includes `needed`."""
        return _ORDER.index(self) >= _ORDER.index(needed)


_ORDER: Final = tuple(UserRole)


def may_log_in(role: UserRole) -> UserRole:
    """Return the role of an account or token.

    Raises:
        ValueError: it is ANYONE, which needs neither.
    """
    if role is UserRole.ANYONE:
        raise ValueError("expected viewer, operator or admin")
    return role


class User(BaseModel):
    """Hold one account; `password` is a hash, `changed_s` wall-clock seconds."""

    model_config = _STRICT

    role: Annotated[UserRole, Field(strict=False)]
    password: str
    changed_s: float

    _role = field_validator("role")(may_log_in)

    @field_validator("password")
    @classmethod
    def _is_hashed(cls, text: str) -> str:
        if not is_password_hash(text):
            raise ValueError("expected scrypt$...; set it by: vla-deploy dashboard password")
        return text


class Token(BaseModel):
    """Hold one token; `digest` is the hash of its secret, times are wall-clock seconds."""

    model_config = _STRICT

    name: Name
    role: Annotated[UserRole, Field(strict=False)]
    digest: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    made_s: float
    expires_s: float | None

    _role = field_validator("role")(may_log_in)

    def is_valid(self, secret: str, now_s: float) -> bool:
        """Return whether a secret is this token's, and the token is valid now."""
        is_own = hmac.compare_digest(_digest(secret), self.digest)
        begun = now_s > self.made_s - CLOCK_SLACK_S
        return is_own and begun and (self.expires_s is None or now_s < self.expires_s)


class Accounts(BaseModel):
    """Hold all accounts, and all tokens by their public ids."""

    model_config = _STRICT

    users: Annotated[dict[Name, User], Field(max_length=MOST_USERS)] = {}
    tokens: Annotated[dict[str, Token], Field(max_length=MOST_TOKENS)] = {}

    def token_of(self, text: str, now_s: float) -> Token | None:
        """Return the valid token of a text, or None where there is none."""
        parts = _TOKEN.fullmatch(text)
        token = self.tokens.get(parts[1]) if parts else None
        return token if parts and token is not None and token.is_valid(parts[2], now_s) else None

    def token_named(self, name: str) -> Token | None:
        """Return the token of a name, None where there is none."""
        return next((one for one in self.tokens.values() if one.name == name), None)

    def with_user(self, name: str, user: User) -> "Accounts":
        """Return the accounts with one user added or changed.

        Raises:
            AccountRefused: the name is invalid, or there are too many users.
        """
        _check_name(name)
        return self._with(users={**self.users, name: user})

    def without_user(self, name: str) -> "Accounts":
        """Return the accounts without one user.

        Raises:
            AccountRefused: there is none of that name.
        """
        if name not in self.users:
            known = ", ".join(sorted(self.users)) or "none"
            raise AccountRefused(f"no user {name!r:.40}; there are: {known}")
        return self._with(users={key: one for key, one in self.users.items() if key != name})

    def with_token(self, token_id: str, token: Token) -> "Accounts":
        """Return the accounts with one token added.

        Raises:
            AccountRefused: the name is in use, or there are too many tokens.
        """
        if any(one.name == token.name for one in self.tokens.values()):
            raise AccountRefused(f"a token {token.name!r} is there; revoke it, or name another")
        return self._with(tokens={**self.tokens, token_id: token})

    def without_token(self, name: str) -> "Accounts":
        """Return the accounts without a token, which is invalid from now on.

        Raises:
            AccountRefused: there is none of that name.
        """
        kept = {key: one for key, one in self.tokens.items() if one.name != name}
        if len(kept) == len(self.tokens):
            known = ", ".join(sorted(one.name for one in self.tokens.values())) or "none"
            raise AccountRefused(f"no token {name!r:.40}; there are: {known}")
        return self._with(tokens=kept)

    def _with(
        self, users: dict[str, User] | None = None, tokens: dict[str, Token] | None = None
    ) -> "Accounts":
        for what, group, most in (
            ("users", users or {}, MOST_USERS),
            ("tokens", tokens or {}, MOST_TOKENS),
        ):
            if len(group) > most:
                raise AccountRefused(f"{most} {what} are all that there may be; remove one")
        return Accounts(
            users=self.users if users is None else users,
            tokens=self.tokens if tokens is None else tokens,
        )


def new_token(
    name: str, role: UserRole, now_s: float, lasts_s: float | None
) -> tuple[str, str, Token]:
    """Return a token's id, its text, which is stored nowhere, and what is stored.

    Raises:
        AccountRefused: the name is invalid.
    """
    _check_name(name)
    token_id, secret = secrets.token_hex(_ID_BYTES), secrets.token_hex(_SECRET_BYTES)
    token = Token(
        name=name,
        role=role,
        digest=_digest(secret),
        made_s=now_s,
        expires_s=None if lasts_s is None else now_s + lasts_s,
    )
    return token_id, f"vla_{token_id}_{secret}", token


def wall_s() -> float:
    """Return the wall clock in seconds since 1970, which dates what outlives a boot."""
    return datetime.now(UTC).timestamp()


def _check_name(name: str) -> None:
    if re.fullmatch(NAME_PATTERN, name) is None:
        raise AccountRefused(
            f"{name!r:.40}: expected a small letter, then up to 31 small letters, digits, _ or -"
        )


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()


class AccountsFile:
    """Read and change the accounts of one robot; several processes may hold one."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._seen: tuple[int, ...] = ()
        self._accounts = Accounts()

    @classmethod
    def of_base(cls, base: Path) -> "AccountsFile":
        """Return the accounts of the robot that runs in a runtime directory."""
        return cls(access_dir_of(base) / ACCOUNTS_FILE)

    def read(self) -> Accounts:
        """Return the accounts; the file is read again only when it has changed.

        Raises:
            AccountsUnusable: it cannot be read, others may read it, or it has faults.
        """
        with self._translated_errors():
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
        """Replace the accounts by the first value that `act` returns; return its second value.

        Raises:
            AccountsUnusable: the file cannot be read or written; it is as it was.
        """
        with self._translated_errors(), turn(self.path.with_suffix(".lock")):
            accounts, result = act(self.read())
            _write(self.path, accounts)
            return result

    @contextmanager
    def _translated_errors(self) -> Iterator[None]:
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
        faults_text = "; ".join(
            f"{'.'.join(map(str, one['loc']))}: {one['msg']}" for one in faults[:8]
        )
        raise AccountsUnusable(
            f"{path}: {faults_text}; mend it, or delete it and set passwords anew"
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
