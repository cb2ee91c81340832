"""Group the errors of accounts and audit log by what the caller can do about them.

AccessError
├── AccountsUnusable     the accounts file cannot be used: mend it, or its permissions
├── AccountRefused       a user or token is not as the operation needs it: choose another name
├── LocalTokenUnusable   the token of the robot's user cannot be read: run as that user
├── LoginLinkUnavailable the dashboard gives no link for a login: see its log, or the user
└── AuditUnusable        the audit log cannot be read: mend its permissions
"""


class AccessError(Exception):
    """Base of everything that access raises."""


class AccountsUnusable(AccessError):
    """Report what is wrong with the accounts file."""


class AccountRefused(AccessError):
    """Report why a user or token cannot be changed as requested."""


class LocalTokenUnusable(AccessError):
    """Report why the token of the robot's user cannot be read."""


class LoginLinkUnavailable(AccessError):
    """Report why the dashboard gives no link for a login."""


class AuditUnusable(AccessError):
    """Report why the audit log cannot be read."""
