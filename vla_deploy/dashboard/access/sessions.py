"""Log users in and hold their sessions; a restart of the dashboard ends all sessions."""

import asyncio
import hashlib
import secrets
import threading
from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.access.accounts import AccountsFile, UserRole
from vla_deploy.client.access.passwords import DEFAULT_COST, Cost, matches, unmatchable_hash
from vla_deploy.dashboard.access.rates import BackOff, BackOffRule
from vla_deploy.dashboard.errors import AccessDenied, Denial

MOST_SESSIONS: Final = 256
_ID_BYTES: Final = 32
PER_ADDRESS: Final = BackOffRule(free=5, first_s=1.0, longest_s=300.0)
# From any address: guesses by others must not lock the owner out for long.
PER_USER: Final = BackOffRule(free=10, first_s=1.0, longest_s=30.0)
_MOST_AT_ONCE: Final = 4


@dataclass(slots=True, kw_only=True)
class LoginSession:
    """Describe one login; `password` is the hash of the password at that time."""

    user: str
    password: str
    csrf: str
    made_ns: int
    used_ns: int


class Sessions:
    """Hold sessions for a limited time; beyond `MOST_SESSIONS` the least recently used one ends."""

    def __init__(self, idle_s: float, longest_s: float, clock: Clock) -> None:
        self._idle_ns = round(idle_s * NS_PER_S)
        self._longest_ns = round(longest_s * NS_PER_S)
        self._clock = clock
        self._lock = threading.Lock()
        self._by_digest: OrderedDict[bytes, LoginSession] = OrderedDict()

    def begin(self, user: str, password: str) -> tuple[str, LoginSession]:
        """Return a new session and its id, which is stored in the cookie alone."""
        session_id = secrets.token_urlsafe(_ID_BYTES)
        now_ns = self._clock.now_ns()
        session = LoginSession(
            user=user,
            password=password,
            csrf=secrets.token_urlsafe(_ID_BYTES),
            made_ns=now_ns,
            used_ns=now_ns,
        )
        with self._lock:
            self._by_digest[_digest(session_id)] = session
            while len(self._by_digest) > MOST_SESSIONS:
                self._by_digest.popitem(last=False)
        return session_id, session

    def find(self, session_id: str) -> LoginSession | None:
        """Return the session of an id and note its use, None where there is none."""
        digest = _digest(session_id)
        with self._lock:
            session = self._by_digest.get(digest)
            if session is None:
                return None
            if self._is_over(session):
                del self._by_digest[digest]
                return None
            session.used_ns = self._clock.now_ns()
            self._by_digest.move_to_end(digest)
            return session

    def end(self, session_id: str) -> None:
        """End the session of an id, if there is one."""
        with self._lock:
            self._by_digest.pop(_digest(session_id), None)

    def _is_over(self, session: LoginSession) -> bool:
        now_ns = self._clock.now_ns()
        idle_ns, lasted_ns = now_ns - session.used_ns, now_ns - session.made_ns
        return idle_ns > self._idle_ns or lasted_ns > self._longest_ns


def _digest(session_id: str) -> bytes:
    """Return the key of a session: the time of a look-up reveals nothing about the id."""
    return hashlib.sha256(session_id.encode(errors="surrogatepass")).digest()


class Logins:
    """Begin sessions for users who know their password; guesses are slowed down."""

    def __init__(
        self,
        accounts: AccountsFile,
        sessions: Sessions,
        clock: Clock,
        cost: Cost = DEFAULT_COST,
    ) -> None:
        """Start without failures; an unknown name takes `cost`, as long as a known one."""
        self._accounts = accounts
        self._sessions = sessions
        self._addresses = BackOff(PER_ADDRESS, clock)
        self._users = BackOff(PER_USER, clock)
        self._nobodys = unmatchable_hash(cost)
        self._under_way = 0

    async def log_in(
        self, user: str, password: str, rate_key: str
    ) -> tuple[str, LoginSession, UserRole]:
        """Return a new session's id, the session and its role; guesses count by `rate_key`.

        Raises:
            AccessDenied: there is no such user, the password is wrong, there were too many
                guesses, or too many users log in at this moment.
            AccountsUnusable: the accounts file cannot be used.
        """
        self._check_wait(user, rate_key)
        self._addresses.begin(rate_key)
        self._users.begin(user)
        account = self._accounts.read().users.get(user)
        stored = self._nobodys if account is None else account.password
        if not await self._compare(password, stored) or account is None:
            raise AccessDenied(
                Denial.LOGIN_FAILED,
                "user and password do not fit together",
                "forgotten? On the robot: vla-deploy dashboard password",
            )
        self._addresses.succeeded(rate_key)
        self._users.succeeded(user)
        session_id, session = self._sessions.begin(user, account.password)
        return session_id, session, account.role

    def knows(self, user: str) -> bool:
        """Return whether a name is that of an account; others are not logged.

        Raises:
            AccountsUnusable: the accounts file cannot be used.
        """
        return user in self._accounts.read().users

    def _check_wait(self, user: str, rate_key: str) -> None:
        wait_s = max(self._addresses.wait_s(rate_key), self._users.wait_s(user))
        if self._under_way >= _MOST_AT_ONCE:
            wait_s = max(wait_s, 1.0)
        if wait_s > 0.0:
            raise AccessDenied(
                Denial.TOO_MANY, "too many logins", f"wait {wait_s:.0f} s", wait_s=wait_s
            )

    async def _compare(self, password: str, stored: str) -> bool:
        self._under_way += 1
        try:
            return await asyncio.to_thread(matches, password, stored)
        finally:
            self._under_way -= 1
