"""Declare what is measured of the topics, and of reading the metrics itself."""

from typing import Final

from vla_deploy.telemetry.metrics.kinds import Kind, Metric
from vla_deploy.telemetry.metrics.paths import Each, Facts, Path, keys

PULSES: Final = "pulses"
"""Not a topic: how far every topic has come, as whoever looks measures it."""
OWN: Final = "own"
"""Not a topic: what whoever looks tells of itself."""


def _of_each(key: str) -> tuple[Path, ...]:
    return ((Each("topic"), keys(key)),)


METRICS: Final[tuple[Metric, ...]] = (
    Metric(
        name="vla_topic_messages_total",
        kind=Kind.COUNTER,
        help="Values ever put to a topic of the shared memory in this run.",
        topic=PULSES,
        paths=_of_each("messages"),
    ),
    Metric(
        name="vla_topic_rate_hertz",
        kind=Kind.GAUGE,
        unit="hertz",
        help="How often a topic is written, over the last 5 s.",
        topic=PULSES,
        paths=_of_each("rate_hz"),
        kept=True,
    ),
    Metric(
        name="vla_topic_age_seconds",
        kind=Kind.GAUGE,
        unit="seconds",
        help="Age of the newest value of a topic that has a deadline.",
        topic=PULSES,
        paths=_of_each("age_s"),
    ),
    Metric(
        name="vla_topic_deadline_seconds",
        kind=Kind.GAUGE,
        unit="seconds",
        help="Age above which a reader calls a topic stale.",
        topic=PULSES,
        paths=_of_each("deadline_s"),
    ),
    Metric(
        name="vla_robot_info",
        kind=Kind.INFO,
        help="Which robot this is, by which profile it runs, and whether it is a twin.",
        topic="process_table",
        paths=((keys("head"), Facts(("robot", "profile", "twin"))),),
    ),
    Metric(
        name="vla_build_info",
        kind=Kind.INFO,
        help="Version of vla_deploy.",
        topic=OWN,
        paths=((Facts(("version",)),),),
    ),
    Metric(
        name="vla_metrics_look_seconds",
        kind=Kind.GAUGE,
        unit="seconds",
        help="Time that reading all metrics took the last time.",
        topic=OWN,
        paths=((keys("look_s"),),),
    ),
    Metric(
        name="vla_metrics_left_out",
        kind=Kind.GAUGE,
        help="Series left out because their metric has more than may be.",
        topic=OWN,
        paths=((keys("left_out"),),),
    ),
    Metric(
        name="vla_dashboard_clients",
        kind=Kind.GAUGE,
        help="Pages that follow the robot live.",
        topic=OWN,
        paths=((keys("clients"),),),
        kept=True,
    ),
)
