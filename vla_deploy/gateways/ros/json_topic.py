"""Publish JSON documents as std_msgs/String, as nodes do that have no messages of their own."""

import json
import math
from typing import Any, Final

from std_msgs.msg import String

from vla_deploy.gateways.ros.graph import RELIABLE, GraphLink

PUBLISHED_BY: Final = "published_by"
"""Where a topic is published and subscribed here, the key by which we know our own."""


class JsonTopic:
    """Publish one topic; numbers that JSON has no form for become null."""

    def __init__(self, graph: GraphLink, topic: str) -> None:
        self._publisher = graph.publisher(String, topic, RELIABLE)

    @property
    def is_wanted(self) -> bool:
        """Return whether anybody listens."""
        return self._publisher.get_subscription_count() > 0

    def tell(self, document: Any) -> None:
        """Publish a document."""
        text = json.dumps(_finite(document), separators=(",", ":"), ensure_ascii=False)
        self._publisher.publish(String(data=text))

    def tell_text(self, text: str) -> None:
        """Publish a text as it is."""
        self._publisher.publish(String(data=text))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
