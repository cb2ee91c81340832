"""Decide who may see the robot, command it, and change it; anyone may stop it."""

from vla_deploy.client.access.accounts import UserRole
from vla_deploy.dashboard.access.access_control import AccessControl, AccessRules
from vla_deploy.dashboard.access.audit_middleware import note
from vla_deploy.dashboard.access.guard import (
    Admin,
    Anyone,
    Operator,
    Require,
    Viewer,
    guard,
    require,
)
from vla_deploy.dashboard.access.identity import AuthMethod, Identity

__all__ = [
    "AccessControl",
    "AccessRules",
    "Admin",
    "Anyone",
    "AuthMethod",
    "Identity",
    "Operator",
    "Require",
    "UserRole",
    "Viewer",
    "guard",
    "note",
    "require",
]
