"""Build the web application; what it serves is listed in `routers.py` and `parts.py`."""

from fastapi import FastAPI

from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import AccessControl, guard
from vla_deploy.dashboard.analysing import Analyst
from vla_deploy.dashboard.errors import add_error_handlers
from vla_deploy.dashboard.headers import SafeHeaders
from vla_deploy.dashboard.page import add_page_files
from vla_deploy.dashboard.parts import PARTS
from vla_deploy.dashboard.routers import API_PREFIX, API_ROUTERS, ROOT_ROUTERS
from vla_deploy.runtime.net import DashboardSettings


def create_app(link: RobotLink, settings: DashboardSettings, access: AccessControl) -> FastAPI:
    """Return the application; `app.state` holds what is given, and what the parts put there.

    Whoever serves it steps `app.state.parts`.
    """
    app = FastAPI(
        title="vla_deploy",
        openapi_url=f"{API_PREFIX}/openapi.json",
        docs_url=None,  # their pages load scripts from other hosts
        redoc_url=None,
    )
    app.state.link, app.state.settings = link, settings
    app.state.analyst = Analyst(link)
    app.state.parts = [make(app) for make in PARTS]
    guard(app, access)
    add_error_handlers(app)
    for router in API_ROUTERS:
        app.include_router(router, prefix=API_PREFIX)
    for router in ROOT_ROUTERS:
        app.include_router(router)
    add_page_files(app)
    app.add_middleware(SafeHeaders)
    return app
