"""Publish what happens: the events of the robot's own topics, each as JSON with a type of event."""

import json
from typing import Any, Final

from vla_deploy_msgs.msg import RobotEvent

from vla_deploy.gateways.ros.graph import RELIABLE
from vla_deploy.gateways.ros.part import Gateway
from vla_deploy.ipc import RingReader

TOPIC: Final = "/vla_deploy/events"
SOURCES: Final = {
    "task_event": "event",
    "operator": "act",
    "voice_event": "event",
    "heard": "verdict",
    "motion_result": "status",
    "flight_event": "event",
}
"""By the topic of shared memory, the key whose value is the kind of event."""


class EventsTopic:
    """Publish every event of those topics, in their order within each."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._events = gateway.graph.publisher(RobotEvent, TOPIC, RELIABLE)
        self._rings: dict[str, RingReader[dict[str, Any]]] = {
            source: gateway.link.events(source) for source in SOURCES
        }

    def step(self, now_ns: int) -> None:
        """Publish what is new."""
        for source, ring in self._rings.items():
            for event in ring.drain():
                self._events.publish(
                    RobotEvent(
                        stamp=self._gateway.time.stamp(event.stamp_ns),
                        kind=str(event.payload.get(SOURCES[source]) or source),
                        source=source,
                        json=json.dumps(event.payload, separators=(",", ":"), ensure_ascii=False),
                    )
                )

    def stop(self) -> None:
        """Close the topics."""
        for ring in self._rings.values():
            ring.close()
