"""Group the errors of the dashboard by who can do something about them.

DashboardError
├── SettingsInvalid    dashboard.toml has faults, all of them are listed: mend the file
├── PortTaken          another program listens there: end it, or choose another port
├── TlsUnusable        certificate or key cannot be used: mend the files, or the settings
└── Refused            a request cannot be carried out: the one who asked is told why, as JSON
"""

from http import HTTPStatus


class DashboardError(Exception):
    """Base of everything that the dashboard raises."""


class Refused(DashboardError):
    """Refuse a request: an HTTP status, a word for programs, what is wrong, what to try."""

    def __init__(self, status: HTTPStatus, code: str, what: str, try_: str) -> None:
        super().__init__(what)
        self.status = status
        self.code = code
        self.what = what
        self.try_ = try_
