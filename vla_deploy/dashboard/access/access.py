"""Judge who asks, and whether they may ask at all."""

import contextlib
import hmac
import logging
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Final, Self

from starlette.requests import cookie_parser
from starlette.types import Receive, Send

from drivers.clock import Clock, MonotonicClock
from vla_deploy.client.access.accounts import Accounts, AccountsFile, Role, wall_s
from vla_deploy.client.access.audit_log import AuditLog
from vla_deploy.client.access.errors import AccountsUnusable
from vla_deploy.client.access.passwords import DEFAULT_COST, Cost
from vla_deploy.dashboard.access.asked import Asked
from vla_deploy.dashboard.access.errors import (
    AccountsAway,
    CsrfRefused,
    RequestRefused,
    TokenRefused,
    TooMany,
)
from vla_deploy.dashboard.access.identity import Identity, Way, nobody
from vla_deploy.dashboard.access.logins import Logins
from vla_deploy.dashboard.access.origin import (
    FORWARDED,
    check_host,
    check_origin,
    host_name,
    is_loopback_name,
)
from vla_deploy.dashboard.access.rates import Buckets
from vla_deploy.dashboard.access.rules import AccessRules
from vla_deploy.dashboard.access.sessions import Sessions
from vla_deploy.dashboard.access.tenure import Tenure
from vla_deploy.runtime.executors import low_priority_thread

CSRF_HEADER: Final = "x-csrf-token"
_COOKIE: Final = "vla_session"
_BEARER: Final = "bearer "
# Who is not logged in has nothing to change but the stop and a login.
_STRANGERS_HZ: Final = 1.0
_STRANGERS_BURST: Final = 20
_log = logging.getLogger(__name__)


class Access:
    """Know accounts, sessions and rules of one dashboard; refuse what may not be asked."""

    def __init__(
        self,
        rules: AccessRules,
        accounts: AccountsFile,
        audit: AuditLog,
        clock: Clock,
        now_s: Callable[[], float] = wall_s,
        cost: Cost = DEFAULT_COST,
    ) -> None:
        """Begin with nobody logged in; `now_s` is the wall clock, which tells tokens' ends."""
        self.rules = rules
        self.accounts = accounts
        self.audit = audit
        self._clock = clock
        self.sessions = Sessions(rules.session_idle_s, rules.session_longest_s, clock)
        self.logins = Logins(accounts, self.sessions, clock, cost)
        self._now_s = now_s
        self._own_names = own_names() | {name.lower() for name in rules.hosts}
        self._acts = Buckets(rules.acts_hz, rules.acts_burst, clock)
        self._strangers = Buckets(_STRANGERS_HZ, _STRANGERS_BURST, clock)

    @classmethod
    def of_base(cls, base: Path, rules: AccessRules, clock: Clock) -> Self:
        """Return the access to the robot that runs in a runtime directory."""
        audit = AuditLog.of_base(base, clock, low_priority_thread(MonotonicClock()))
        return cls(rules, AccountsFile.of_base(base), audit, clock)

    def close(self) -> None:
        """Write what the audit log has not written yet."""
        self.audit.close()

    def admit(self, asked: Asked) -> Identity:
        """Return who asks; whether that is enough, the route's `require` says.

        Raises:
            HostRefused: the robot was reached under a name that is not its own.
            OriginRefused: another site's page asks.
            TokenRefused: a token was sent that does not count.
            CsrfRefused: a session changes something without its token.
            TooMany: too many changes.
            AccountsAway: the file of accounts cannot be used.
        """
        if not asked.peer.is_socket:
            check_host(host_name(asked.headers), self._own_names)
            check_origin(asked.method, asked.scheme, asked.headers, self.rules.origins)
        identity = self.identify(asked)
        if asked.is_change:
            self._check_csrf(asked, identity)
            self._check_rate(asked, identity)
        return identity

    def admit_stop(self, asked: Asked) -> Identity:
        """Return who presses the stop; nothing that is wrong with it refuses it."""
        with contextlib.suppress(RequestRefused):
            return self.identify(asked)
        return nobody(asked.peer.address)

    def identify(self, asked: Asked) -> Identity:
        """Return who asks: by token, else by session, else by where the connection comes from.

        Raises:
            TokenRefused: a token was sent that does not count.
            AccountsAway: the file of accounts cannot be used.
        """
        authorization = asked.first("authorization")
        if authorization:
            return self._by_token(asked, authorization)
        return self._by_session(asked) or self._by_place(asked)

    def tenure(self, asked: Asked, receive: Receive, send: Send) -> Tenure:
        """Return the messages of a WebSocket, which end when its owner's role does."""
        return Tenure(receive, send, lambda: self._role_now(asked), self._clock)

    def cookie_name(self) -> str:
        """Return the cookie's name; under https one that no other host can have set."""
        return f"__Host-{_COOKIE}" if self.rules.is_https else _COOKIE

    def session_id(self, asked: Asked) -> str:
        """Return the id that the cookie holds, "" when there is none."""
        for header in asked.headers.get("cookie", ()):
            found = cookie_parser(header).get(self.cookie_name())
            if found:
                return found
        return ""

    def _role_now(self, asked: Asked) -> Role:
        try:
            return self.identify(asked).role
        except RequestRefused:
            return Role.ANYONE

    def _by_token(self, asked: Asked, authorization: str) -> Identity:
        is_bearer = authorization.lower().startswith(_BEARER)
        text = authorization[len(_BEARER) :].strip() if is_bearer else ""
        token = self._read().token_of(text, self._now_s())
        if token is None:
            self._check_stranger(asked)
            raise TokenRefused(
                "expected `Authorization: Bearer vla_...` with a token that counts",
                "it is unknown, revoked or expired; make one: vla-deploy dashboard token add",
            )
        address = asked.peer.address
        return Identity(role=token.role, user=f"token:{token.name}", way=Way.TOKEN, address=address)

    def _by_session(self, asked: Asked) -> Identity | None:
        session_id = self.session_id(asked)
        session = self.sessions.find(session_id) if session_id else None
        if session is None:
            return None
        user = self._read().users.get(session.user)
        if user is None or user.password != session.password:
            self.sessions.end(session_id)
            return None
        return Identity(
            role=user.role,
            user=session.user,
            way=Way.SESSION,
            address=asked.peer.address,
            csrf=session.csrf,
        )

    def _by_place(self, asked: Asked) -> Identity:
        address = asked.peer.address
        if asked.peer.is_socket:
            return Identity(role=Role.ADMIN, user="local", way=Way.SOCKET, address=address)
        if self._is_trusted(asked):
            return Identity(role=Role.ADMIN, user="local", way=Way.LOOPBACK, address=address)
        return nobody(address)

    def _is_trusted(self, asked: Asked) -> bool:
        """Tell whether a person at this computer asks, by its own name and by no proxy."""
        return (
            self.rules.trust_loopback
            and asked.peer.is_loopback
            and is_loopback_name(host_name(asked.headers))
            and not any(name in asked.headers for name in FORWARDED)
        )

    def _check_csrf(self, asked: Asked, identity: Identity) -> None:
        if identity.way is not Way.SESSION or asked.is_login:
            return
        given, own = asked.first(CSRF_HEADER).encode(), identity.csrf.encode()
        if not hmac.compare_digest(given, own):
            raise CsrfRefused(
                f"a change without the session's {CSRF_HEADER}",
                "take `csrf` from GET /api/v1/session, and send it as a header",
            )

    def _check_rate(self, asked: Asked, identity: Identity) -> None:
        if identity.role is Role.ANYONE:
            self._check_stranger(asked)
            return
        keys = {f"from {asked.peer.home}", f"by {identity.user}"}
        _check_wait(max(self._acts.take(key) for key in keys))

    def _check_stranger(self, asked: Asked) -> None:
        _check_wait(self._strangers.take(asked.peer.home))

    def _read(self) -> Accounts:
        try:
            return self.accounts.read()
        except AccountsUnusable as error:
            _log.error("nobody can log in: %s", error)
            raise AccountsAway(
                "the file of accounts cannot be used", "see the dashboard's log on the robot"
            ) from error


def own_names() -> frozenset[str]:
    """Return the names under which a local network finds this computer."""
    name = socket.gethostname().lower()
    return frozenset({name, f"{name.partition('.')[0]}.local"})


def _check_wait(wait_s: float) -> None:
    if wait_s > 0.0:
        raise TooMany(
            "too many requests that change something", f"wait {wait_s:.1f} s", wait_s=wait_s
        )
