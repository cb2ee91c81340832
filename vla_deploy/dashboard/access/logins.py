"""Compare passwords, ever more slowly with who guesses."""

import asyncio
from typing import Final

from drivers.clock import Clock
from vla_deploy.client.access.accounts import AccountsFile, Role
from vla_deploy.client.access.passwords import DEFAULT_COST, Cost, fits, nobodys
from vla_deploy.dashboard.access.errors import LoginFailed, TooMany
from vla_deploy.dashboard.access.rates import BackOff, BackOffRule
from vla_deploy.dashboard.access.sessions import Session, Sessions

PER_ADDRESS: Final = BackOffRule(free=5, first_s=1.0, longest_s=300.0)
# From anywhere: its owner must not be locked out for long by somebody else's guesses.
PER_USER: Final = BackOffRule(free=10, first_s=1.0, longest_s=30.0)
_MOST_AT_ONCE: Final = 4


class Logins:
    """Begin sessions for who knows a password."""

    def __init__(
        self,
        accounts: AccountsFile,
        sessions: Sessions,
        clock: Clock,
        cost: Cost = DEFAULT_COST,
    ) -> None:
        """Begin without guesses; a name that is none costs `cost`, as a known one does."""
        self._accounts = accounts
        self._sessions = sessions
        self._addresses = BackOff(PER_ADDRESS, clock)
        self._users = BackOff(PER_USER, clock)
        self._nobodys = nobodys(cost)
        self._under_way = 0

    async def log_in(self, user: str, password: str, home: str) -> tuple[str, Session, Role]:
        """Return a new session's id, the session and its role; guesses are counted by `home`.

        Raises:
            LoginFailed: there is no such user, or that is not the password.
            TooMany: the last guesses were too many, or others log in right now.
            AccountsUnusable: the file of accounts cannot be used.
        """
        self._check_turn(user, home)
        self._addresses.begin(home)
        self._users.begin(user)
        account = self._accounts.read().users.get(user)
        stored = self._nobodys if account is None else account.password
        if not await self._compare(password, stored) or account is None:
            raise LoginFailed(
                "user and password do not fit together",
                "forgotten? On the robot: vla-deploy dashboard password",
            )
        self._addresses.succeeded(home)
        self._users.succeeded(user)
        session_id, session = self._sessions.begin(user, account.password)
        return session_id, session, account.role

    def knows(self, user: str) -> bool:
        """Tell whether a name is that of an account; others are not written down.

        Raises:
            AccountsUnusable: the file of accounts cannot be used.
        """
        return user in self._accounts.read().users

    def _check_turn(self, user: str, home: str) -> None:
        wait_s = max(self._addresses.wait_s(home), self._users.wait_s(user))
        if self._under_way >= _MOST_AT_ONCE:
            wait_s = max(wait_s, 1.0)
        if wait_s > 0.0:
            raise TooMany("too many logins", f"wait {wait_s:.0f} s", wait_s=wait_s)

    async def _compare(self, password: str, stored: str) -> bool:
        self._under_way += 1
        try:
            return await asyncio.to_thread(fits, password, stored)
        finally:
            self._under_way -= 1
