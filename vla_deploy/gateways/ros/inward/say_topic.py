"""Take texts that the robot is to say aloud."""

import logging
from typing import Any, Final

from std_msgs.msg import String

from vla_deploy.gateways.ros.graph import RELIABLE
from vla_deploy.gateways.ros.inward.orders import OrderInvalid
from vla_deploy.gateways.ros.inward.words import checked_text
from vla_deploy.gateways.ros.part import Gateway
from vla_deploy.ipc.announcer import Announcer

TOPIC: Final = "/vla_deploy/say"
_log = logging.getLogger(__name__)


class SayTopic:
    """Pass to the robot's voice what comes on the topic."""

    def __init__(self, gateway: Gateway) -> None:
        link = gateway.link
        self._voice = Announcer(link.space, link.source, link.clock)
        gateway.graph.hear(String, TOPIC, self._take, RELIABLE)

    def step(self, now_ns: int) -> None:
        """Do nothing: the voice follows its texts itself."""

    def stop(self) -> None:
        """Close the topics."""
        self._voice.close()

    def _take(self, message: Any, sender: str) -> None:
        try:
            text = checked_text(message.data)
        except OrderInvalid as error:
            _log.warning("%s from %s refused: %s", TOPIC, sender, error)
            return
        why = self._voice.why_silent()
        if why:
            _log.warning("%s from %s will not be heard: %s", TOPIC, sender, why)
        self._voice.say(text)
