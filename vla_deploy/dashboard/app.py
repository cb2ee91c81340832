"""Build the web application: its routes, its parts, and the checks before them."""

from typing import Final

from fastapi import APIRouter, FastAPI

from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard import page
from vla_deploy.dashboard.access import AccessControl, guard
from vla_deploy.dashboard.access import routes as access_routes
from vla_deploy.dashboard.access.request import API_PREFIX
from vla_deploy.dashboard.api import (
    agents,
    analysis,
    commands,
    memory,
    metrics,
    missions,
    operate,
    profile,
    recordings,
    robot,
    state,
)
from vla_deploy.dashboard.errors import add_error_handlers
from vla_deploy.dashboard.live import endpoint, microphone
from vla_deploy.dashboard.page import SafeHeaders, add_page_files
from vla_deploy.dashboard.parts import make_parts
from vla_deploy.runtime.net import DashboardSettings

# Below the prefix.
API_ROUTERS: Final[tuple[APIRouter, ...]] = (
    access_routes.router,
    state.router,
    analysis.router,
    commands.router,
    agents.router,
    missions.router,
    memory.router,
    operate.router,
    profile.router,
    recordings.router,
    recordings.replay_router,
    endpoint.router,
    microphone.router,
    robot.router,
    metrics.router,
)
# At the root: the page, and what has its place by convention.
ROOT_ROUTERS: Final[tuple[APIRouter, ...]] = (page.router, state.health, metrics.scraped)


def create_app(link: RobotLink, settings: DashboardSettings, access: AccessControl) -> FastAPI:
    """Return the application; the server steps `app.state.parts`.

    `app.state` holds `link`, `settings`, `access`, `parts`, and what the parts put there.
    """
    app = FastAPI(
        title="vla_deploy",
        openapi_url=f"{API_PREFIX}/openapi.json",
        docs_url=None,  # their pages load scripts from other hosts
        redoc_url=None,
    )
    app.state.link, app.state.settings = link, settings
    app.state.parts = make_parts(app)
    guard(app, access)
    add_error_handlers(app)
    for router in API_ROUTERS:
        app.include_router(router, prefix=API_PREFIX)
    for router in ROOT_ROUTERS:
        app.include_router(router)
    add_page_files(app)
    app.add_middleware(SafeHeaders)
    return app
