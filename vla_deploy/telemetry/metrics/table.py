"""Join all metrics: the one table, from which exposition, history, alerts and mappings come."""

from collections.abc import Mapping
from typing import Final

from vla_deploy.ipc import BY_NAME
from vla_deploy.telemetry.metrics import computer, control, flow, minds, processes
from vla_deploy.telemetry.metrics.kinds import Metric

METRICS: Final[tuple[Metric, ...]] = (
    *control.METRICS,
    *processes.METRICS,
    *computer.METRICS,
    *minds.METRICS,
    *flow.METRICS,
)

METRICS_BY_NAME: Final[Mapping[str, Metric]] = {metric.name: metric for metric in METRICS}

READ_TOPICS: Final[tuple[str, ...]] = tuple(
    sorted({metric.topic for metric in METRICS} & set(BY_NAME))
)
"""The topics that the metrics are told by."""
