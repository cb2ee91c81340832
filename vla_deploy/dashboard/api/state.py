"""Tell how the robot is."""

from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

from fastapi import APIRouter, Depends, Request

from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.telemetry.robot_state import collect

router = APIRouter(tags=["state"])
health = APIRouter(tags=["state"])


@router.get("/state", dependencies=[Depends(require(UserRole.VIEWER))])
async def get_state(request: Request) -> dict[str, Any]:
    """Return what every process tells of itself; what is silent is null."""
    told = collect(request.app.state.link)
    return {
        **told,
        "version": version("vla-deploy"),
        "wall_time": datetime.now(UTC).isoformat(timespec="milliseconds"),
    }


@health.get("/healthz", dependencies=[Depends(require(UserRole.ANYONE))])
async def get_health() -> dict[str, bool]:
    """Say that the dashboard answers; of the robot it says nothing."""
    return {"answers": True}
