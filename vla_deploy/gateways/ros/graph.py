"""Join the ROS 2 graph: one node, one executor in a thread of its own, one queue for what comes in.

What comes in is handled in the node's step, in the order of arrival, so that only one thread
deals with the robot. A press of the stop does not wait for that.
"""

import json
import logging
import math
import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, Final

import rclpy
from rclpy._rclpy_pybind11 import NodeNameNonExistentError
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.publisher import Publisher
from rclpy.qos import (
    DurabilityPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from std_msgs.msg import String

from vla_deploy.gateways.ros.declaring import SteadyNode

NODE_NAME: Final = "vla_deploy"
PUBLISHED_BY: Final = "published_by"
"""Where a topic is published and subscribed here, the key by which we know our own."""
MOST_WAITING: Final = 256
"""Of what comes in between two steps; what is more is dropped, and counted."""
SOURCE: Final = "ros"
_NAME_LETTERS: Final = 44
_NAMELESS: Final = "_NODE_NAME_UNKNOWN_"
_LOOKS: Final = 4
"""Steps in which the name of who sent something is looked for: a stop in words may wait for it."""
_JOIN_S: Final = 2.0
_log = logging.getLogger(__name__)

RELIABLE: Final = QoSProfile(depth=10)
SENSOR: Final = qos_profile_sensor_data
LATCHED: Final = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# A subscription that takes from publishers of either reliability.
ANY: Final = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


def named(nodes: Iterable[str]) -> str:
    """Return how a command from these nodes names its source."""
    listed = ",".join(nodes)[:_NAME_LETTERS]
    return f"{SOURCE}:{listed}" if listed else SOURCE


class _Waking(Future):  # type: ignore[misc]  # rclpy has no types
    """Wake the executor with the result: rclpy 7 looks at what awaits only when something comes."""

    def __init__(self, executor: SingleThreadedExecutor) -> None:
        super().__init__(executor=executor)
        self._waiting = executor

    def set_result(self, result: Any) -> None:
        """Set the result, and have what waits for it go on."""
        super().set_result(result)
        self._waiting.wake()


class GraphLink:
    """Hold the node's end of the ROS 2 graph."""

    def __init__(self, parameters: Mapping[str, Any]) -> None:
        """Join with these values of the parameters."""
        self.dropped = 0
        self._inbox: deque[Callable[[], None]] = deque()
        self._context = rclpy.Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self.node: Final = SteadyNode(NODE_NAME, parameters, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._servers: list[ActionServer | ActionClient] = []
        self._spinning = threading.Thread(target=self._spin, name="ros-spin", daemon=True)

    def begin(self) -> None:
        """Admit what comes from the graph."""
        self._spinning.start()

    def publisher(self, kind: type, topic: str, qos: QoSProfile = RELIABLE) -> Publisher:
        """Return a publisher."""
        return self.node.create_publisher(kind, topic, qos)

    def listen(
        self, kind: type, topic: str, take: Callable[[Any], None], qos: QoSProfile = ANY
    ) -> None:
        """Subscribe; each message is taken in a step."""
        self.node.create_subscription(kind, topic, lambda got: self.put(lambda: take(got)), qos)

    def hear(
        self, kind: type, topic: str, take: Callable[[Any, str], None], qos: QoSProfile = RELIABLE
    ) -> None:
        """Subscribe; each message is taken in a step, with who sent it."""

        def receive(message: Any) -> None:
            sender = self.sender(topic)  # now: who sends once may be gone in a moment
            if sender == SOURCE:
                find = partial(self.sender, topic)
                self.put(lambda: self.when_named(find, partial(take, message)))
            else:
                self.put(lambda: take(message, sender))

        self.node.create_subscription(kind, topic, receive, qos)

    def when_named(
        self, find: Callable[[], str], take: Callable[[str], None], looks: int = _LOOKS
    ) -> None:
        """Give `take`, in a step, the name that `find` returns.

        DDS has a node's name after its publishers and clients, so some steps are waited for it.
        """
        name = find()
        if name == SOURCE and looks:
            self.put(lambda: self.when_named(find, take, looks - 1))
        else:
            take(name)

    def sender(self, topic: str) -> str:
        """Return which other nodes publish a topic, for logs and the audit trail.

        rclpy does not say which publisher a message came from: of several all are named.
        """
        try:
            found = self.node.get_publishers_info_by_topic(topic)
        except RuntimeError as error:  # rcl's errors; a press of the stop must not fail by a name
            _log.warning("who publishes %s is not known: %s", topic, error)
            return named(())
        return named(self._others((one.node_name, one.node_namespace) for one in found))

    def caller(self, service: str) -> str:
        """Return which other nodes have a client of a service: its caller is among them."""
        callers = []
        for name, namespace in self.node.get_node_names_and_namespaces():
            try:
                clients = self.node.get_client_names_and_types_by_node(name, namespace)
            except (RuntimeError, NodeNameNonExistentError):
                continue  # it has left the graph meanwhile
            if any(one == service for one, _ in clients):
                callers.append((name, namespace))
        return named(self._others(callers))

    def _others(self, nodes: Iterable[tuple[str, str]]) -> list[str]:
        full = {f"{namespace.rstrip('/')}/{name}" for name, namespace in nodes}
        own = self.node.get_fully_qualified_name()
        return sorted(one for one in full if one != own and _NAMELESS not in one)

    def serve(self, kind: type, name: str, answer: Callable[[Any], Future]) -> None:
        """Serve; a request is answered by what the future holds that `answer` returns."""

        async def respond(request: Any, _response: Any) -> Any:
            return await answer(request)

        self.node.create_service(kind, name, respond)

    def act(self, server: ActionServer | ActionClient) -> None:
        """Keep a server or a client of an action until the end."""
        self._servers.append(server)

    def future(self) -> Future:
        """Return a future whose result wakes what waits for it in the graph's thread."""
        return _Waking(self._executor)

    def perform(self, work: Callable[[], None]) -> None:
        """Queue work for the graph's thread; it must not raise, else that thread ends."""
        self._executor.create_task(work)

    def put(self, work: Callable[[], None]) -> bool:
        """Queue work for the next step; return whether there is room for it."""
        if len(self._inbox) >= MOST_WAITING:
            self.dropped += 1
            return False
        self._inbox.append(work)
        return True

    def take(self) -> None:
        """Do in order what has come in since the last step."""
        for _ in range(len(self._inbox)):
            self._inbox.popleft()()

    def close(self) -> None:
        """Leave the graph; the thread ends before what it uses."""
        self._executor.shutdown()
        if self._spinning.ident is not None:
            self._spinning.join(_JOIN_S)
        for server in self._servers:
            server.destroy()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    def _spin(self) -> None:
        try:
            self._executor.spin()
        except ExternalShutdownException:
            _log.info("left the ROS graph")


class JsonTopic:
    """Publish JSON documents as std_msgs/String, as nodes do that have no messages of their own.

    Several topics get the same; numbers that JSON has no form for become null.
    """

    def __init__(self, graph: GraphLink, *topics: str) -> None:
        self._publishers = [graph.publisher(String, topic) for topic in topics]

    @property
    def is_wanted(self) -> bool:
        """Return whether anybody listens."""
        return any(one.get_subscription_count() > 0 for one in self._publishers)

    def publish(self, document: Any) -> None:
        """Publish a document."""
        text = json.dumps(_finite(document), separators=(",", ":"), ensure_ascii=False)
        self.publish_text(text)

    def publish_text(self, text: str) -> None:
        """Publish a text as it is."""
        for publisher in self._publishers:
            publisher.publish(String(data=text))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
