"""Take texts from topics: words or plans go to the planner as everybody's do, others to the voice.

Who sends is named in the command's source. What is no command is refused in words on the planners'
feedback topics, and nothing else happens by it.
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final

from std_msgs.msg import String

from vla_deploy.gateways.ros.graph import NODE_NAME, PUBLISHED_BY
from vla_deploy.gateways.ros.inward.orders import CommandOrder, CommandOrders
from vla_deploy.gateways.ros.part import Gateway, GatewayPart
from vla_deploy.gateways.words import (
    OrderInvalid,
    checked_text,
    is_stop_word,
    read_message,
    shown,
)
from vla_deploy.ipc.announcer import Announcer

COMMAND_TOPICS: Final[Mapping[str, str]] = {
    "/natural_language/command": "a command in words",
    "/vla/command": "a command in words",
    "/cognitive_planner/goal": "a goal in words",
    "/voice_command/parsed": "JSON with original_command, from a recogniser of somebody else's",
}
"""Every topic that takes commands, and what it is for; each takes words and JSON alike."""
MOST_OPEN: Final = 16
"""Of commands from topics at a time; a stop is taken beyond that."""
SAY: Final = "/vla_deploy/say"
_OURS: Final = f"/{NODE_NAME}"
_log = logging.getLogger(__name__)


@dataclass(slots=True, kw_only=True, eq=False)
class _Open:
    topic: str
    order: CommandOrder
    asking: set[str] = field(default_factory=set)
    """Ids of the commands that wait for an answer: parts of a mission may, one by one."""

    def follow(self) -> None:
        """Take what is new."""
        while self.order.news:
            event = self.order.news.popleft()
            if event["event"] == "asked":
                self.asking.add(event["command_id"])
            else:
                self.asking.discard(event["command_id"])


class CommandTopics(GatewayPart):
    """Give what comes to the planner, and answers to what the robot has asked on that topic."""

    def __init__(self, gateway: Gateway, orders: CommandOrders) -> None:
        self._gateway = gateway
        self._orders = orders
        self._open: list[_Open] = []
        for topic in COMMAND_TOPICS:
            gateway.graph.hear(String, topic, partial(self._take, topic))

    def step(self, now_ns: int) -> None:
        """Follow the commands that are under way, to know which of them wait for an answer."""
        for one in list(self._open):
            one.follow()
            if one.order.last is not None:
                self._open.remove(one)

    def _take(self, topic: str, message: Any, sender: str) -> None:
        try:
            found = read_message(message.data)
            if (found.stated or {}).get(PUBLISHED_BY) == _OURS:
                return  # what the robot itself has heard, and is doing already
            if len(self._open) >= MOST_OPEN and not is_stop_word(found.text):
                raise OrderInvalid(f"{MOST_OPEN} commands are under way or wait; try again later")
            order = self._orders.give(
                text=found.text,
                plan=found.plan,
                mission=found.mission,
                source=sender,
                is_answer=bool(found.text) and self._is_asked(topic),
            )
        except OrderInvalid as error:
            _log.warning("%s from %s refused: %s", topic, sender, error)
            self._refuse(shown(message.data), sender, topic, str(error))
            return
        _log.info("%s from %s: %s", topic, sender, shown(message.data))
        self._open.append(_Open(topic=topic, order=order))

    def _refuse(self, command: str, source: str, topic: str, why: str) -> None:
        """Publish why something is no command; nothing was done by it."""
        self._gateway.feedback.publish(
            {
                "status": "error",
                "stage": "planning",
                "command": command,
                "command_id": "",
                "source": source,
                "topic": topic,
                "error": why,
            }
        )

    def _is_asked(self, topic: str) -> bool:
        return any(one.topic == topic and one.asking for one in self._open)


class SayTopic(GatewayPart):
    """Pass to the robot's voice what comes on the topic."""

    def __init__(self, gateway: Gateway) -> None:
        link = gateway.link
        self._voice = Announcer(link.space, link.source, link.clock)
        gateway.graph.hear(String, SAY, self._take)

    def stop(self) -> None:
        """Close the topics."""
        self._voice.close()

    def _take(self, message: Any, sender: str) -> None:
        try:
            text = checked_text(message.data)
        except OrderInvalid as error:
            _log.warning("%s from %s refused: %s", SAY, sender, error)
            return
        why = self._voice.why_silent()
        if why:
            _log.warning("%s from %s will not be heard: %s", SAY, sender, why)
        self._voice.say(text)
