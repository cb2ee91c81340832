"""Identify the user of a request, and refuse requests that no user may make."""

import contextlib
import hmac
import logging
import socket
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from starlette.requests import cookie_parser
from starlette.types import Receive, Send

from drivers.clock import Clock, MonotonicClock
from vla_deploy.client.access.accounts import Accounts, AccountsFile, UserRole, wall_s
from vla_deploy.client.access.audit_log import AuditLog
from vla_deploy.client.access.errors import AccountsUnusable
from vla_deploy.client.access.local_token import LOCAL
from vla_deploy.client.access.passwords import DEFAULT_COST, Cost
from vla_deploy.dashboard.access.identity import AuthMethod, Identity, unknown_user
from vla_deploy.dashboard.access.login_links import LocalSession, LocalSessions, LoginLinks
from vla_deploy.dashboard.access.rates import TokenBuckets
from vla_deploy.dashboard.access.request import (
    FORWARDED,
    IncomingRequest,
    check_host,
    check_origin,
    host_name,
    is_loopback_name,
)
from vla_deploy.dashboard.access.session_expiry import SessionExpiry
from vla_deploy.dashboard.access.sessions import Logins, Sessions
from vla_deploy.dashboard.errors import AccessDenied, Denial
from vla_deploy.runtime.executors import low_priority_thread

_HOUR_S: Final = 3600.0
CSRF_HEADER: Final = "x-csrf-token"
_COOKIE: Final = "vla_session"
_BEARER: Final = "bearer "
# A user who is not logged in changes nothing but the stop and a login.
_UNKNOWN_HZ: Final = 1.0
_UNKNOWN_BURST: Final = 20
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class AccessRules:
    """Configure access to one dashboard.

    `trust_loopback` makes every user of this computer an admin, and every container on its network;
    behind a reverse proxy on this computer also everyone whom the proxy admits. `hosts` are further
    names of the robot, `origins` those of pages that a proxy serves for it, such as
    `https://robot.example`. A session ends `session_idle_s` after its last use. A known user may
    change `acts_burst` things at once and `acts_hz` in the long run.
    """

    trust_loopback: bool = False
    hosts: tuple[str, ...] = ()
    origins: tuple[str, ...] = ()
    is_https: bool = False
    session_idle_s: float = 12 * _HOUR_S
    session_longest_s: float = 168 * _HOUR_S
    acts_hz: float = 10.0
    acts_burst: int = 40


class AccessControl:
    """Hold accounts, sessions and rules of one dashboard, and check requests by them."""

    def __init__(
        self,
        rules: AccessRules,
        accounts: AccountsFile,
        audit: AuditLog,
        clock: Clock,
        now_s: Callable[[], float] = wall_s,
        cost: Cost = DEFAULT_COST,
    ) -> None:
        """Start without sessions; `now_s` is the wall clock, by which tokens expire."""
        self.rules = rules
        self.accounts = accounts
        self.audit = audit
        self._clock = clock
        self.sessions = Sessions(rules.session_idle_s, rules.session_longest_s, clock)
        self.local_sessions = LocalSessions(rules.session_longest_s)
        self.links = LoginLinks(clock)
        self.logins = Logins(accounts, self.sessions, clock, cost)
        self._now_s = now_s
        self._own_names = own_names() | {name.lower() for name in rules.hosts}
        self._acts = TokenBuckets(rules.acts_hz, rules.acts_burst, clock)
        self._unknown = TokenBuckets(_UNKNOWN_HZ, _UNKNOWN_BURST, clock)

    @classmethod
    def of_base(cls, base: Path, rules: AccessRules, clock: Clock) -> Self:
        """Return the access control of the robot that runs in a runtime directory."""
        audit = AuditLog.of_base(base, clock, low_priority_thread(MonotonicClock()))
        return cls(rules, AccountsFile.of_base(base), audit, clock)

    def close(self) -> None:
        """Write the audit entries that wait."""
        self.audit.close()

    def admit(self, request: IncomingRequest) -> Identity:
        """Return the identity of the user; the route's `require` checks the role.

        Raises:
            AccessDenied: the robot was reached under a name that is not its own, another site's
                page asks, a token is invalid, a session changes something without its CSRF token,
                there are too many changes, or the accounts file cannot be used.
        """
        if not request.peer.is_socket:
            check_host(host_name(request.headers), self._own_names)
            check_origin(request.method, request.scheme, request.headers, self.rules.origins)
        identity = self.identify(request)
        if request.is_change:
            self._check_csrf(request, identity)
            self._check_rate(request, identity)
        return identity

    def admit_stop(self, request: IncomingRequest) -> Identity:
        """Return the identity of the user who presses the stop; it is never refused."""
        with contextlib.suppress(AccessDenied):
            return self.identify(request)
        return unknown_user(request.peer.address)

    def identify(self, request: IncomingRequest) -> Identity:
        """Return the identity: by token, else by session, else by the connection's origin.

        Raises:
            AccessDenied: a token is invalid, or the accounts file cannot be used.
        """
        authorization = request.first("authorization")
        if authorization:
            return self._by_token(request, authorization)
        return self._by_session(request) or self._by_connection(request)

    def session_expiry(
        self, request: IncomingRequest, receive: Receive, send: Send
    ) -> SessionExpiry:
        """Return the channel of a WebSocket, which closes when its session or token ends."""
        return SessionExpiry(receive, send, lambda: self._role_now(request), self._clock)

    def begin_local(self, code: str) -> tuple[str, Identity]:
        """Return the id of a session for who followed a link, and the identity that it gives.

        Raises:
            AccessDenied: the code of the link does not count, or the accounts cannot be used.
        """
        session_id = None
        if self.links.redeem(code):
            session_id = self.local_sessions.begin(self._read(), self._now_s())
        found = session_id and self.local_sessions.find(session_id, self._read(), self._now_s())
        if not session_id or not found:
            raise AccessDenied(
                Denial.LINK_REFUSED,
                "this link has been followed before, or is too old",
                "make a new one, on the robot: vla-deploy dashboard",
            )
        return session_id, _of_link(found, "")

    def end_session(self, session_id: str) -> None:
        """End a session, if the id is of one."""
        self.sessions.end(session_id)
        self.local_sessions.end(session_id)

    def cookie_name(self) -> str:
        """Return the cookie's name; under https one that no other host can have set."""
        return f"__Host-{_COOKIE}" if self.rules.is_https else _COOKIE

    def session_id(self, request: IncomingRequest) -> str:
        """Return the id that the cookie holds, "" when there is none."""
        for header in request.headers.get("cookie", ()):
            found = cookie_parser(header).get(self.cookie_name())
            if found:
                return found
        return ""

    def _role_now(self, request: IncomingRequest) -> UserRole:
        try:
            return self.identify(request).role
        except AccessDenied:
            return UserRole.ANYONE

    def _by_token(self, request: IncomingRequest, authorization: str) -> Identity:
        is_bearer = authorization.lower().startswith(_BEARER)
        text = authorization[len(_BEARER) :].strip() if is_bearer else ""
        token = self._read().token_of(text, self._now_s())
        if token is None:
            self._check_unknown(request)
            raise AccessDenied(
                Denial.TOKEN_REFUSED,
                "expected `Authorization: Bearer vla_...` with a token that counts",
                "it is unknown, revoked or expired; make one: vla-deploy dashboard token add",
            )
        address = request.peer.address
        return Identity(
            role=token.role, user=f"token:{token.name}", way=AuthMethod.TOKEN, address=address
        )

    def _by_session(self, request: IncomingRequest) -> Identity | None:
        session_id = self.session_id(request)
        return self._by_link(request, session_id) or self._by_password(request, session_id)

    def _by_link(self, request: IncomingRequest, session_id: str) -> Identity | None:
        if not session_id:
            return None
        found = self.local_sessions.find(session_id, self._read(), self._now_s())
        return None if found is None else _of_link(found, request.peer.address)

    def _by_password(self, request: IncomingRequest, session_id: str) -> Identity | None:
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
            way=AuthMethod.SESSION,
            address=request.peer.address,
            csrf=session.csrf,
        )

    def _by_connection(self, request: IncomingRequest) -> Identity:
        address = request.peer.address
        if not request.peer.is_socket and not self._is_trusted(request):
            return unknown_user(address)
        way = AuthMethod.SOCKET if request.peer.is_socket else AuthMethod.LOOPBACK
        return Identity(role=UserRole.ADMIN, user=LOCAL, way=way, address=address)

    def _is_trusted(self, request: IncomingRequest) -> bool:
        """Return whether the request comes from this computer, by its own name and no proxy."""
        return (
            self.rules.trust_loopback
            and request.peer.is_loopback
            and is_loopback_name(host_name(request.headers))
            and not any(name in request.headers for name in FORWARDED)
        )

    def _check_csrf(self, request: IncomingRequest, identity: Identity) -> None:
        if identity.way is not AuthMethod.SESSION or request.is_login:
            return
        given, own = request.first(CSRF_HEADER).encode(), identity.csrf.encode()
        if not hmac.compare_digest(given, own):
            raise AccessDenied(
                Denial.CSRF_REFUSED,
                f"a change without the session's {CSRF_HEADER}",
                "take `csrf` from GET /api/v1/session, and send it as a header",
            )

    def _check_rate(self, request: IncomingRequest, identity: Identity) -> None:
        if identity.role is UserRole.ANYONE:
            self._check_unknown(request)
            return
        keys = {f"from {request.peer.rate_key}", f"by {identity.user}"}
        _check_wait(max(self._acts.take(key) for key in keys))

    def _check_unknown(self, request: IncomingRequest) -> None:
        _check_wait(self._unknown.take(request.peer.rate_key))

    def _read(self) -> Accounts:
        try:
            return self.accounts.read()
        except AccountsUnusable as error:
            _log.error("nobody can log in: %s", error)
            raise accounts_away() from error


def _of_link(found: LocalSession, address: str) -> Identity:
    return Identity(
        role=found.token.role,
        user=LOCAL,
        way=AuthMethod.SESSION,
        address=address,
        csrf=found.csrf,
    )


def accounts_away() -> AccessDenied:
    """Return the denial while the accounts file cannot be used."""
    what, hint = "the file of accounts cannot be used", "see the dashboard's log on the robot"
    return AccessDenied(Denial.ACCOUNTS_AWAY, what, hint)


def own_names() -> frozenset[str]:
    """Return the names by which a local network finds this computer."""
    name = socket.gethostname().lower()
    return frozenset({name, f"{name.partition('.')[0]}.local"})


def _check_wait(wait_s: float) -> None:
    if wait_s > 0.0:
        raise AccessDenied(
            Denial.TOO_MANY,
            "too many requests that change something",
            f"wait {wait_s:.1f} s",
            wait_s=wait_s,
        )
