"""Arrange the viewer's window: the world beside what is asked first of a robot that stopped."""

from typing import Any, Final

from vla_deploy.telemetry.channels import TICKS
from vla_deploy.telemetry.rerun.entity import LOGS, PLOTS, WORLD
from vla_deploy.telemetry.rerun.plots import JOINT_TOPIC

_CURVES: Final = (
    f"{JOINT_TOPIC}/position",
    f"{JOINT_TOPIC}/effort_ratio",
    "base_state",
    f"{TICKS}/period_s",
)


def layout() -> Any:
    """Return a blueprint of Rerun's; a person may arrange everything anew."""
    from rerun import blueprint

    curves = [blueprint.TimeSeriesView(origin=f"{PLOTS}/{one}", name=one) for one in _CURVES]
    return blueprint.Blueprint(
        blueprint.Horizontal(
            blueprint.Vertical(
                blueprint.Spatial3DView(origin=WORLD, name=WORLD),
                blueprint.TextLogView(origin=LOGS, name=LOGS),
                row_shares=[3, 1],
            ),
            blueprint.Vertical(*curves),
            column_shares=[3, 2],
        )
    )
