"""Find topics that grow old although their process is at work."""

from collections.abc import Iterator, Mapping
from typing import Final

from vla_deploy.dashboard.alarms.finding import Finding, Severity
from vla_deploy.dashboard.alarms.told import Told
from vla_deploy.ipc import TOPICS, Topic, TopicKind

BY_OWNER: Final[Mapping[str, Severity]] = {"control": Severity.CRITICAL}
"""How grave a silent topic is by its owner; of others it is a warning."""
ON_DEMAND: Final = frozenset({"base_command"})
"""Written while the base is driven; safety judges its age then."""
OF_SENSOR: Final[Mapping[str, str]] = {
    "scan": "lidar",
    "imu": "imu",
    "near_obstacles": "camera",
}
"""Topics that fall silent with one sensor while their process goes on; `away` may say why."""
_SUPERVISOR: Final = "supervisor"
_LEAST_RATIO: Final = 0.01
_RISE_S: Final = 1.0
_CABLE: Final = "check its cable and power; it is taken up again by itself"
_AGAIN: Final = "the supervisor starts it again before long; see why"
_CELLS: Final = tuple(
    topic
    for topic in TOPICS
    if topic.kind is TopicKind.CELL and topic.deadline_s and topic.name not in ON_DEMAND
)


def old_topics(told: Told) -> Iterator[Finding]:
    """Find cells beyond their deadline; one that is told to work slowly has more time."""
    away = (told.document("scene") or {}).get("away", {})
    for topic in _CELLS:
        age_s = told.age_s(topic.name)
        if age_s is None or not _is_at_work(told, topic) or OF_SENSOR.get(topic.name) in away:
            continue
        limit_s = topic.deadline_s / _rate_ratio(told, topic.owner)
        if age_s > limit_s:
            yield _old(topic, age_s, limit_s, _silent_sensor(told, topic))


def _is_at_work(told: Told, topic: Topic) -> bool:
    """Tell whether its age says something: the supervisor's own silence is another alarm."""
    if topic.owner == _SUPERVISOR:
        return topic.name != "process_table" and told.document("process_table") is not None
    return told.is_ready(topic.owner)


def _rate_ratio(told: Told, process: str) -> float:
    directives = told.document("resource_directives") or {}
    return max(float(directives.get("rate_ratio", {}).get(process, 1.0)), _LEAST_RATIO)


def _silent_sensor(told: Told, topic: Topic) -> str:
    """Return the sensor that is to blame: its process writes all that needs it not."""
    sensor = OF_SENSOR.get(topic.name, "")
    return sensor if sensor and told.document("scene") is not None else ""


def _old(topic: Topic, age_s: float, limit_s: float, sensor: str) -> Finding:
    culprit = f"the {sensor} has gone silent: no {topic.name}"
    return Finding(
        process=topic.owner,
        field=topic.name,
        subject=sensor,
        text=culprit if sensor else f"{topic.owner} has gone silent on {topic.name}",
        severity=BY_OWNER.get(topic.owner, Severity.WARNING),
        advice=_CABLE if sensor else f"{_AGAIN}: vla-deploy logs {topic.owner}",
        measured=age_s,
        limit=limit_s,
        unit="s",
        age_s=age_s,
        rise_s=_RISE_S,
    )
