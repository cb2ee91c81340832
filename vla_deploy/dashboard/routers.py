"""List the routes: one row per group."""

from typing import Final

from fastapi import APIRouter

from vla_deploy.dashboard import page
from vla_deploy.dashboard.access import routes as access
from vla_deploy.dashboard.alarms import routes as alarms
from vla_deploy.dashboard.api import (
    analysis,
    commands,
    files,
    logs,
    operate,
    profile,
    recordings,
    replay,
    state,
)
from vla_deploy.dashboard.live import endpoint, microphone, routes
from vla_deploy.dashboard.metering import routes as metering

API_PREFIX: Final = "/api/v1"

# Below the prefix.
API_ROUTERS: Final[tuple[APIRouter, ...]] = (
    access.router,
    state.router,
    analysis.router,
    commands.router,
    operate.router,
    profile.router,
    files.router,
    logs.router,
    recordings.router,
    replay.router,
    alarms.router,
    endpoint.router,
    microphone.router,
    routes.router,
    metering.router,
)
# At the root: the page, and what has its place by convention.
ROOT_ROUTERS: Final[tuple[APIRouter, ...]] = (page.router, state.health, metering.scraped)
