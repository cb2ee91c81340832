"""Publish what the robot hears as commands, and what it says.

`/tts/say` carries what the robot has to say, for a voice of somebody else's; texts to be said by
the robot are taken on another topic, else it would answer itself.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

from vla_deploy.client.command_record import Kind
from vla_deploy.gateways.ros.commands import CommandNews
from vla_deploy.gateways.ros.graph import NODE_NAME, PUBLISHED_BY, JsonTopic
from vla_deploy.gateways.ros.part import Gateway, GatewayPart
from vla_deploy.ipc import topics

PARSED: Final = "/voice_command/parsed"
SAID: Final = "/tts/say"
VOICE: Final = "voice"
_STOP: Final = "stop"
_UNKNOWN: Final = "unknown"


class VoiceTopics(GatewayPart):
    """Publish commands that came by voice once they are understood, and texts to be said."""

    def __init__(self, gateway: Gateway) -> None:
        graph, link = gateway.graph, gateway.link
        self._gateway = gateway
        self._parsed = JsonTopic(graph, PARSED)
        self._said = JsonTopic(graph, SAID)
        self._say = link.events(topics.SAY)
        self._heard = link.events(topics.HEARD)
        self._confidence: dict[str, float | None] = {}

    def step(self, now_ns: int) -> None:
        """Publish what is new."""
        for event in self._say.drain():
            said = event.payload
            if "cancel" not in said and said["text"]:
                self._said.publish_text(said["text"])
        for heard in self._heard.drain():
            self._note(heard.payload)
        for news in self._gateway.commands.news:
            record = news.record
            if record.source == VOICE and record.kind is Kind.COMMAND:
                self._take(news)

    def stop(self) -> None:
        """Close the topics."""
        self._say.close()
        self._heard.close()

    def _note(self, heard: Mapping[str, Any]) -> None:
        """Keep how sure words are until they are understood; a stop needs no understanding."""
        text = str(heard.get("text", ""))
        self._confidence = {text: heard.get("confidence")}
        if heard.get("verdict") == _STOP:
            self._publish(text, intent=_STOP)

    def _take(self, news: CommandNews) -> None:
        record, name = news.record, news.event.get("event")
        if name == "plan":
            plan = news.event["plan"]
            given = [one["parameters"] for one in plan["actions"]]
            self._publish(
                record.text,
                intent=_intent_of(plan),
                things=_named(given, "object"),
                location=next(iter(_named(given, "place", "destination")), None),
                stamp_s=record.given_s,
            )
        elif name == "rejected":
            self._publish(record.text, intent=_UNKNOWN, stamp_s=record.given_s)

    def _publish(
        self,
        text: str,
        *,
        intent: str,
        things: Sequence[str] = (),
        location: str | None = None,
        stamp_s: float | None = None,
    ) -> None:
        now = self._gateway.time.now()
        self._parsed.publish(
            {
                "original_command": text,
                "text": text,
                "intent": intent,
                "objects": list(things),
                "location": location,
                "confidence": self._confidence.get(text),
                "timestamp": now.sec + now.nanosec / 1e9 if stamp_s is None else stamp_s,
                PUBLISHED_BY: f"/{NODE_NAME}",
            }
        )


def _intent_of(plan: Mapping[str, Any]) -> str:
    """Return what a plan is for: the planner's own word for it, else by its last skill."""
    first = str(plan.get("summary", "")).partition(":")[0].split(",")[0].strip()
    if first in _INTENTS:
        return first
    skills = [one["skill"] for one in plan["actions"]]
    return next((_BY_SKILL[one] for one in reversed(skills) if one in _BY_SKILL), _UNKNOWN)


_INTENTS: Final = frozenset(
    {"navigation", "manipulation", "cleaning", "search", "assist", "stop", "question"}
)
_BY_SKILL: Final = {
    **dict.fromkeys(
        ("navigate_to", "charge", "follow_person", "guard", "sweep", "move", "turn"), "navigation"
    ),
    **dict.fromkeys(("pick_up", "place", "open_gripper", "close_gripper"), "manipulation"),
    **dict.fromkeys(("find_object", "look_at", "inspect"), "search"),
    **dict.fromkeys(("speak", "hand_over", "wait", "turn_on", "turn_off"), "assist"),
    "stop": "stop",
}


def _named(given: list[Mapping[str, Any]], *keys: str) -> list[str]:
    found = [str(one[key]) for one in given for key in keys if key in one]
    return list(dict.fromkeys(found))
