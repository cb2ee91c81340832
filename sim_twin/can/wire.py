"""Connect emulated CAN nodes and outside ports: every frame reaches everyone but its sender."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Protocol

import can

Port = Callable[[can.Message], None]


class CanNode(Protocol):
    """Emulate one node: take frames, and send through what `connect` was given."""

    def connect(self, send: Port) -> None:
        """Remember how to put a frame on the wire."""
        ...

    def receive(self, frame: can.Message) -> None:
        """Take one frame that someone else has sent."""
        ...


class CanWire:
    """Carry frames in the order in which they were sent; answers queue behind their cause.

    `cut` models a pulled plug between the ports (the robot's computer) and the nodes.
    """

    def __init__(self, nodes: Sequence[CanNode] = ()) -> None:
        self.cut = False
        self.frames_carried = 0
        self._nodes: list[CanNode] = []
        self._ports: list[Port] = []
        self._pending: deque[tuple[can.Message, object]] = deque()
        self._carrying = False
        for node in nodes:
            self.add_node(node)

    def add_node(self, node: CanNode) -> None:
        """Connect an emulated node."""
        self._nodes.append(node)
        node.connect(lambda frame: self.send(frame, node))

    def attach(self, port: Port) -> None:
        """Hand every further frame to `port`."""
        self._ports.append(port)

    def detach(self, port: Port) -> None:
        """Stop handing frames to `port`."""
        self._ports.remove(port)

    def send(self, frame: can.Message, sender: object) -> None:
        """Carry one frame, and every answer to it, to all but their senders."""
        self._pending.append((frame, sender))
        if self._carrying:
            return
        self._carrying = True
        try:
            while self._pending:
                self._carry(*self._pending.popleft())
        finally:
            self._carrying = False

    def _carry(self, frame: can.Message, sender: object) -> None:
        self.frames_carried += 1
        from_node = sender in self._nodes
        if from_node or not self.cut:
            for node in self._nodes:
                if node is not sender:
                    node.receive(frame)
        if not from_node or not self.cut:
            for port in tuple(self._ports):
                if port != sender:
                    port(frame)
