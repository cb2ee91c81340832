"""Decide who may see the robot, command it, and change it; anyone may stop it."""

from vla_deploy.client.access.accounts import Role
from vla_deploy.client.access.errors import AccessError
from vla_deploy.dashboard.access.access import Access
from vla_deploy.dashboard.access.errors import RequestRefused
from vla_deploy.dashboard.access.identity import Identity, Way
from vla_deploy.dashboard.access.requiring import (
    Admin,
    Anyone,
    Operator,
    Require,
    Viewer,
    guard,
    require,
)
from vla_deploy.dashboard.access.rules import AccessRules
from vla_deploy.dashboard.access.witness import note

__all__ = [
    "Access",
    "AccessError",
    "AccessRules",
    "Admin",
    "Anyone",
    "Identity",
    "Operator",
    "RequestRefused",
    "Require",
    "Role",
    "Viewer",
    "Way",
    "guard",
    "note",
    "require",
]
