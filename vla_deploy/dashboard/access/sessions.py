"""Hold who is logged in by a cookie; a restart of the dashboard logs everybody out."""

import hashlib
import secrets
import threading
from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S, Clock

MOST_SESSIONS: Final = 256
_ID_BYTES: Final = 32


@dataclass(slots=True, kw_only=True)
class Session:
    """Describe one login; `password` is what was stored of the password that it was made by."""

    user: str
    password: str
    csrf: str
    made_ns: int
    used_ns: int


class Sessions:
    """Keep logins for a time; beyond `most`, the one that was used longest ago ends."""

    def __init__(
        self, idle_s: float, longest_s: float, clock: Clock, most: int = MOST_SESSIONS
    ) -> None:
        self._idle_ns = round(idle_s * NS_PER_S)
        self._longest_ns = round(longest_s * NS_PER_S)
        self._clock = clock
        self._most = most
        self._lock = threading.Lock()
        self._by_digest: OrderedDict[bytes, Session] = OrderedDict()

    def begin(self, user: str, password: str) -> tuple[str, Session]:
        """Return a new session and its id, which only the cookie holds from now on."""
        session_id = secrets.token_urlsafe(_ID_BYTES)
        now_ns = self._clock.now_ns()
        session = Session(
            user=user,
            password=password,
            csrf=secrets.token_urlsafe(_ID_BYTES),
            made_ns=now_ns,
            used_ns=now_ns,
        )
        with self._lock:
            self._by_digest[_digest(session_id)] = session
            while len(self._by_digest) > self._most:
                self._by_digest.popitem(last=False)
        return session_id, session

    def find(self, session_id: str) -> Session | None:
        """Return the session of an id, and note its use; None when it has ended, or never was."""
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
        """End a session, if there is one of that id."""
        with self._lock:
            self._by_digest.pop(_digest(session_id), None)

    def _is_over(self, session: Session) -> bool:
        now_ns = self._clock.now_ns()
        idle_ns, lasted_ns = now_ns - session.used_ns, now_ns - session.made_ns
        return idle_ns > self._idle_ns or lasted_ns > self._longest_ns


def _digest(session_id: str) -> bytes:
    """Return what a session is kept under: how long a look-up takes tells nothing of the id."""
    return hashlib.sha256(session_id.encode(errors="surrogatepass")).digest()
