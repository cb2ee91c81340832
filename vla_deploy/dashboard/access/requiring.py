"""Say at a route which role it needs."""

from collections.abc import Callable
from typing import Annotated, Final

from fastapi import Depends, FastAPI
from starlette.requests import HTTPConnection

from vla_deploy.client.access.accounts import Role
from vla_deploy.dashboard.access.access import Access
from vla_deploy.dashboard.access.answers import answer
from vla_deploy.dashboard.access.errors import LoginNeeded, RequestRefused, RoleTooLow
from vla_deploy.dashboard.access.guard import AccessGuard
from vla_deploy.dashboard.access.identity import IDENTITY, Identity
from vla_deploy.dashboard.access.witness import note_required

Required = Callable[[HTTPConnection], Identity]


class Require:
    """Let through who has a role; a test finds by it the routes that ask for none.

    It is a coroutine, so that no request, and the stop least of all, waits for a thread for it:
    there are 40 of them, and answers that read slow disks may hold them all.
    """

    def __init__(self, role: Role) -> None:
        self.role = role

    async def __call__(self, connection: HTTPConnection) -> Identity:
        """Return who asks.

        Raises:
            LoginNeeded: nothing is known of them.
            RoleTooLow: they may less.
        """
        note_required(connection, self.role)
        identity: Identity = getattr(connection.state, IDENTITY)
        if identity.role.allows(self.role):
            return identity
        if identity.role is Role.ANYONE:
            raise LoginNeeded(
                f"this needs the role {self.role}",
                "log in, or send a token; none yet? On the robot: vla-deploy dashboard password",
            )
        raise RoleTooLow(
            f"{identity.user} is {identity.role}, this needs {self.role}", "ask an admin"
        )


_REQUIRED: Final = {role: Require(role) for role in Role}


def require(role: Role) -> Require:
    """Return the dependency of a route that needs a role: `Depends(require(Role.OPERATOR))`."""
    return _REQUIRED[role]


Anyone = Annotated[Identity, Depends(require(Role.ANYONE))]
Viewer = Annotated[Identity, Depends(require(Role.VIEWER))]
Operator = Annotated[Identity, Depends(require(Role.OPERATOR))]
Admin = Annotated[Identity, Depends(require(Role.ADMIN))]


def guard(app: FastAPI, access: Access) -> None:
    """Put access before every route of an application."""
    app.state.access = access
    app.add_middleware(AccessGuard, access=access)
    app.add_exception_handler(RequestRefused, answer)
