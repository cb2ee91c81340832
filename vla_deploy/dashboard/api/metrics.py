"""Answer metrics, their history, and the reasons for missing values."""

import asyncio
import json
from collections.abc import AsyncIterator
from http import HTTPStatus
from typing import Annotated, Any, Final

import numpy as np
from fastapi import APIRouter, Depends, Query, Request
from fastapi.responses import Response, StreamingResponse
from numpy.typing import NDArray

from vla_deploy.dashboard.access import UserRole, require
from vla_deploy.dashboard.errors import ApiError
from vla_deploy.telemetry.metrics import METRICS, METRICS_BY_NAME, Readings, expose
from vla_deploy.telemetry.metrics.diagnostics import diagnostics
from vla_deploy.telemetry.trends import KEPT, LEVELS, Trends, TrendStore, level_for, unit_of

_Viewer: Final = Depends(require(UserRole.VIEWER))
router = APIRouter(tags=["metrics"], dependencies=[_Viewer])
scraped = APIRouter(tags=["metrics"], dependencies=[_Viewer])

_LONGEST_SPAN_S: Final = LEVELS[-1].span_s
_MOST_NAMES: Final = 64


@scraped.get("/metrics", response_class=Response)
async def get_metrics(request: Request) -> Response:
    """Return every metric in Prometheus' text format, or in OpenMetrics on request."""
    readings = request.app.state.metering.readings()
    text, content_type = expose(readings, request.headers.get("accept", ""))
    return Response(text, headers={"content-type": content_type})


@router.get("/metrics")
async def get_metrics_as_json(request: Request) -> dict[str, Any]:
    """Return every metric with its values, and the reasons for missing ones."""
    readings: Readings = request.app.state.metering.readings()
    return {
        "metrics": [
            {
                "name": metric.name,
                "kind": metric.kind.value,
                "unit": metric.unit,
                "help": metric.help,
                "values": [
                    {
                        "labels": dict(zip(metric.labels, point.labels, strict=True)),
                        "value": point.value,
                    }
                    for point in readings.points.get(metric.name, ())
                    if isinstance(point.value, float)
                ],
            }
            for metric in METRICS
        ],
        "missing": {one.metric: {"why": one.why, "text": one.text} for one in readings.missing},
    }


@router.get("/diagnostics")
async def get_diagnostics(request: Request) -> dict[str, Any]:
    """Return the same as diagnostic_msgs/DiagnosticArray of ROS 2, as plain data."""
    part = request.app.state.metering
    return diagnostics(part.readings(), round(part.wall_s * 1e9))


@router.get("/history/series")
async def get_series(request: Request) -> dict[str, Any]:
    """Return which series are kept, each with its unit, and how far back they go."""
    return {
        "series": [
            {"series": series, **_identity(series), "unit": unit_of(series)}
            for series in _store(request).series()
            if series.partition("/")[0] in KEPT
        ],
        "levels": [{"span_s": level.span_s, "step_s": level.step_s} for level in LEVELS],
    }


@router.get("/history")
async def get_history(
    request: Request,
    series: Annotated[str, Query(max_length=4096, description="names, by commas; a metric: all")],
    span_s: Annotated[float, Query(gt=0, le=_LONGEST_SPAN_S)] = 600.0,
) -> StreamingResponse:
    """Return series over the last `span_s`: mean (`values`), minimum and maximum of each step.

    Counters are given as rates per second. `null` is a step without data.
    """
    store = _store(request)
    names = _chosen(store, series)
    wall_s = request.app.state.metering.wall_s
    trends = store.read(names, level_for(span_s), wall_s, span_s)
    missing = request.app.state.metering.readings().missing
    asked = {name.partition("/")[0] for name in series.split(",")}
    head = {
        "span_s": span_s,
        "step_s": trends.step_s,
        "end_s": wall_s,
        "times_s": _times_s(trends, len(next(iter(trends.series.values())).mean) if names else 0),
        "missing": {one.metric: one.text for one in missing if one.metric in asked},
    }
    return StreamingResponse(_serialised(head, names, trends), media_type="application/json")


async def _serialised(head: dict[str, Any], names: list[str], trends: Trends) -> AsyncIterator[str]:
    """Serialise series one by one: all at once would block the event loop."""
    yield json.dumps(head).removesuffix("}") + ', "series": ['
    for place, name in enumerate(names):
        yield (", " if place else "") + json.dumps(_document(name, trends))
        await asyncio.sleep(0)
    yield "]}"


def _store(request: Request) -> TrendStore:
    part = request.app.state.metering
    if part.store is None:
        raise ApiError(
            HTTPStatus.SERVICE_UNAVAILABLE,
            "no_history",
            part.why_not or "the dashboard is being stopped",
            "make room on the disk that holds logs and history, then restart the robot",
        )
    store: TrendStore = part.store
    return store


def _chosen(store: TrendStore, asked: str) -> list[str]:
    """Return the kept series that are requested, by their names or their metrics' names."""
    wanted = list(dict.fromkeys(name.strip() for name in asked.split(",")))
    unknown = [name for name in wanted if name.partition("/")[0] not in KEPT]
    if unknown or len(wanted) > _MOST_NAMES:
        raise ApiError(
            HTTPStatus.NOT_FOUND,
            "no_such_series",
            f"no history of {unknown[0][:80]!r}" if unknown else f"more than {_MOST_NAMES} names",
            "GET /api/v1/history/series lists what is kept",
        )
    return [
        series
        for series in store.series()
        if series in wanted or series.partition("/")[0] in wanted
    ]


def _times_s(trends: Trends, count: int) -> list[float]:
    return [trends.start_s + (step + 0.5) * trends.step_s for step in range(count)]


def _document(series: str, trends: Trends) -> dict[str, Any]:
    trend = trends.series[series]
    return {
        "series": series,
        **_identity(series),
        "unit": unit_of(series),
        "values": _numbers(trend.mean),
        "min": _numbers(trend.minimum),
        "max": _numbers(trend.maximum),
    }


def _identity(series: str) -> dict[str, Any]:
    name, *values = series.split("/")
    labels = METRICS_BY_NAME[name].labels if name in METRICS_BY_NAME else ()
    return {"name": name, "labels": dict(zip(labels, values, strict=False))}


def _numbers(values: NDArray[np.float32]) -> list[float | None]:
    return [float(f"{value:.7g}") if np.isfinite(value) else None for value in values.tolist()]
