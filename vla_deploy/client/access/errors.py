"""Group the errors of accounts and audit log by what the caller can do about them.

AccessError
├── AccountsUnusable     the accounts file cannot be used: mend it, or its permissions
├── AccountRefused       a user or token is not as the operation needs it: choose another name
└── AuditUnusable        the audit log cannot be read: mend its permissions
"""


class AccessError(Exception):
    """Base of everything that access raises."""


class AccountsUnusable(AccessError):
    """Say what is wrong with the file of accounts."""


class AccountRefused(AccessError):
    """Say why an act on a user or a token cannot be carried out."""


class AuditUnusable(AccessError):
    """Say why the audit log cannot be read."""
