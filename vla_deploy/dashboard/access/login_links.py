"""Log a browser of the robot's own user in: by a link that counts once, then by a signed cookie.

The cookie is signed with the digest of the token `local`, so it outlives a restart of the
dashboard, and ends when that token is revoked.
"""

import hashlib
import hmac
import secrets
from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.client.access.accounts import CLOCK_SLACK_S, Accounts, Token
from vla_deploy.client.access.local_token import LOCAL

VALID_S: Final = 600.0
MOST_WAITING: Final = 16
MOST_ENDED: Final = 1024
_CODE_BYTES: Final = 24
_PREFIX: Final = f"{LOCAL}."


class LoginLinks:
    """Hold the codes of links that wait to be followed, each of them once."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._waiting: OrderedDict[bytes, int] = OrderedDict()

    def issue(self) -> str:
        """Return a new code; of more than `MOST_WAITING` the oldest one ends."""
        code = secrets.token_urlsafe(_CODE_BYTES)
        self._waiting[_digest(code)] = self._clock.now_ns() + round(VALID_S * NS_PER_S)
        while len(self._waiting) > MOST_WAITING:
            self._waiting.popitem(last=False)
        return code

    def redeem(self, code: str) -> bool:
        """Return whether a code counts, which it does no more from now on."""
        valid_until_ns = self._waiting.pop(_digest(code), 0)
        return self._clock.now_ns() < valid_until_ns


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalSession:
    """Describe a login by link: the token that it rests on, and what its changes repeat."""

    token: Token
    csrf: str


class LocalSessions:
    """Sign and judge the cookies of logins by link; those that were logged out are remembered."""

    def __init__(self, longest_s: float) -> None:
        self._longest_s = longest_s
        self._ended: OrderedDict[str, None] = OrderedDict()

    def begin(self, accounts: Accounts, now_s: float) -> str | None:
        """Return the id of a new session, None where there is no token to rest on."""
        token = accounts.token_named(LOCAL)
        if token is None:
            return None
        body = f"{_PREFIX}{round(now_s + self._longest_s)}.{secrets.token_urlsafe(_CODE_BYTES)}"
        return f"{body}.{_sign(token, 'session', body)}"

    def find(self, session_id: str, accounts: Accounts, now_s: float) -> LocalSession | None:
        """Return the session of an id, None where it is none, or has ended."""
        body, _, signature = session_id.rpartition(".")
        token = accounts.token_named(LOCAL)
        if token is None or not body.startswith(_PREFIX) or session_id in self._ended:
            return None
        own = _sign(token, "session", body)
        if not hmac.compare_digest(signature.encode(errors="replace"), own.encode()):
            return None
        ends_s = int(body.split(".")[1])
        is_within = ends_s - self._longest_s - CLOCK_SLACK_S <= now_s < ends_s
        return LocalSession(token=token, csrf=_sign(token, "csrf", body)) if is_within else None

    def end(self, session_id: str) -> None:
        """End a session, where the id is of one."""
        if session_id.startswith(_PREFIX):
            self._ended[session_id] = None
            while len(self._ended) > MOST_ENDED:
                self._ended.popitem(last=False)


def _sign(token: Token, purpose: str, body: str) -> str:
    text = f"{purpose}:{body}".encode(errors="replace")
    return hmac.new(bytes.fromhex(token.digest), text, hashlib.sha256).hexdigest()


def _digest(code: str) -> bytes:
    return hashlib.sha256(code.encode(errors="surrogatepass")).digest()
