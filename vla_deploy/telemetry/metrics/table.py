"""The one table of metrics: exposition, history, alerts and diagnostics are derived from it.

Its parts are in the modules of this package; those of the topics themselves and of reading the
metrics are here.
"""

from collections.abc import Mapping
from functools import partial
from typing import Final

from vla_deploy.ipc import BY_NAME
from vla_deploy.telemetry.metrics import computer, control, model_metrics, processes
from vla_deploy.telemetry.metrics.metric import Metric
from vla_deploy.telemetry.metrics.paths import Path, at, each, facts, keys, path

PULSES: Final = "pulses"
"""Not a topic: count, rate and age of every topic, as the reader of the metrics measures them."""
OWN: Final = "own"
"""Not a topic: what the reader of the metrics reports of itself."""
_pulse = partial(Metric, topic=PULSES)
_own = partial(Metric, topic=OWN)
_process = partial(Metric, topic="process_table")


def _of_each(key: str) -> tuple[Path, ...]:
    return path(each("topic"), keys(key))


FLOW: Final[tuple[Metric, ...]] = (
    _pulse(
        "vla_topic_messages_total",
        "Values ever put to a topic of the shared memory in this run.",
        _of_each("messages"),
    ),
    _pulse(
        "vla_topic_rate_hertz",
        "How often a topic is written, over the last 5 s.",
        _of_each("rate_hz"),
        kept=True,
    ),
    _pulse(
        "vla_topic_age_seconds",
        "Age of the newest value of a topic that has a deadline.",
        _of_each("age_s"),
    ),
    _pulse(
        "vla_topic_deadline_seconds",
        "Age above which a reader calls a topic stale.",
        _of_each("deadline_s"),
    ),
    _process(
        "vla_robot_info",
        "Which robot this is, by which profile it runs, and whether it is a twin.",
        path(keys("head"), facts("robot", "profile", "twin")),
    ),
    _own(
        "vla_build_info",
        "Version of vla_deploy.",
        path(
            facts("version"),
        ),
    ),
    _own(
        "vla_metrics_look_seconds",
        "Time that reading all metrics took the last time.",
        at("look_s"),
    ),
    _own(
        "vla_metrics_left_out",
        "Series left out because their metric has more than may be.",
        at("left_out"),
    ),
    _own("vla_dashboard_clients", "Pages that follow the robot live.", at("clients"), kept=True),
)

METRICS: Final[tuple[Metric, ...]] = (
    *control.METRICS,
    *processes.METRICS,
    *computer.METRICS,
    *computer.BATTERY,
    *model_metrics.METRICS,
    *FLOW,
)

METRICS_BY_NAME: Final[Mapping[str, Metric]] = {metric.name: metric for metric in METRICS}

READ_TOPICS: Final[tuple[str, ...]] = tuple(
    sorted({metric.topic for metric in METRICS} & set(BY_NAME))
)
"""The topics that metrics are read from."""
