"""Group the errors of access by what the caller can do about them.

AccessError
├── AccountsUnusable     the file of accounts cannot be used: mend it, or its rights
├── AccountRefused       a user or token is not as the act needs it: name another one
├── AuditUnusable        the audit log cannot be read: mend its rights
└── RequestRefused       answered to whoever asked, with a status of HTTP; nothing was done
    ├── LoginNeeded      401: log in, or send a token
    ├── LoginFailed      401: user and password do not fit together
    ├── TokenRefused     401: unknown, revoked or expired
    ├── RoleTooLow       403: ask somebody with the role
    ├── OriginRefused    403: the request comes from another site's page
    ├── CsrfRefused      403: a change without the session's own token
    ├── HostRefused      421: the name under which the robot was reached is not one of its own
    ├── BodyRefused      400: no JSON that may be read
    ├── BodyTooLarge     413: more bytes than any act needs
    ├── BodyTooSlow      408: the body did not come in time
    ├── TooMany          429: wait as long as it says
    ├── AccountsAway     503: nobody can log in; the robot's log says why
    └── AuditAway        503: the audit log cannot be read; the robot's log says why
"""

from typing import ClassVar


class RequestRefused(Exception):
    """Say why a request is refused, and what to try; `wait_s` where only time helps."""

    status: ClassVar[int] = 403
    code: ClassVar[str] = "refused"

    def __init__(self, what: str, hint: str, wait_s: float | None = None) -> None:
        super().__init__(what)
        self.what = what
        self.hint = hint
        self.wait_s = wait_s


class LoginNeeded(RequestRefused):
    """Say that nobody is logged in."""

    status = 401
    code = "login_needed"


class LoginFailed(RequestRefused):
    """Say that user and password do not fit together, and no more."""

    status = 401
    code = "login_failed"


class TokenRefused(RequestRefused):
    """Say that a token counts no more, or never did."""

    status = 401
    code = "token_refused"


class RoleTooLow(RequestRefused):
    """Say which role an act needs."""

    code = "role_too_low"


class OriginRefused(RequestRefused):
    """Say which page a request comes from."""

    code = "origin_refused"


class CsrfRefused(RequestRefused):
    """Say that a change came without the session's own token."""

    code = "csrf_refused"


class HostRefused(RequestRefused):
    """Say under which name the robot was reached."""

    status = 421
    code = "host_refused"


class BodyRefused(RequestRefused):
    """Say why a body is not read."""

    status = 400
    code = "body_refused"


class BodyTooLarge(RequestRefused):
    """Say how much a body may hold."""

    status = 413
    code = "body_too_large"


class BodyTooSlow(RequestRefused):
    """Say how long a body may take."""

    status = 408
    code = "body_too_slow"


class TooMany(RequestRefused):
    """Say how long to wait."""

    status = 429
    code = "too_many"


class AccountsAway(RequestRefused):
    """Say that nobody can be known by an account now."""

    status = 503
    code = "accounts_away"


class AuditAway(RequestRefused):
    """Say that the audit log cannot be shown now."""

    status = 503
    code = "audit_away"
