"""Every route says which role it needs; what strangers may use is listed here, and nowhere else."""

import pytest
from fastapi.routing import APIRoute, APIWebSocketRoute

from vla_deploy.dashboard.access import Require, UserRole
from vla_deploy.dashboard.access.request import API_PREFIX
from vla_deploy.dashboard.app import API_ROUTERS, ROOT_ROUTERS

OPEN = {
    "/",
    "/favicon.ico",
    "/healthz",
    f"{API_PREFIX}/session",
    f"{API_PREFIX}/login",
    f"{API_PREFIX}/login/code",
    f"{API_PREFIX}/logout",
    f"{API_PREFIX}/stop",
}
ROUTES = [
    (prefix + route.path, route)
    for prefix, routers in ((API_PREFIX, API_ROUTERS), ("", ROOT_ROUTERS))
    for router in routers
    for route in router.routes
]


def roles_of(route):
    return [one.call.role for one in route.dependant.dependencies if isinstance(one.call, Require)]


@pytest.mark.parametrize(("path", "route"), ROUTES, ids=lambda one: str(getattr(one, "name", one)))
def test_a_route_names_the_role_that_it_needs(path, route):
    assert isinstance(route, (APIRoute, APIWebSocketRoute)), f"{path}: nothing asks who comes"
    roles = roles_of(route)
    assert roles, f"{path}: add Depends(require(UserRole...))"
    assert (max(roles, key=list(UserRole).index) is UserRole.ANYONE) == (path in OPEN)


def test_what_changes_something_needs_more_than_a_viewer():
    lax = [
        path
        for path, route in ROUTES
        if isinstance(route, APIRoute)
        and route.methods - {"GET", "HEAD"}
        and path not in OPEN
        and not any(role.allows(UserRole.OPERATOR) for role in roles_of(route))
    ]
    assert lax == []
