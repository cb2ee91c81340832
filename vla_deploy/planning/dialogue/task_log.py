"""Follow what commands ask for and how their actions end, for the context of models."""

from collections import OrderedDict, deque
from typing import Final

from vla_deploy.client.action_status import FINAL
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.tasks import TaskEvent
from vla_deploy.planning.interfaces import ActionNote

MOST_ACTIONS: Final = 5
_MOST_COMMANDS: Final = 32


class TaskLog:
    """Hold the words of the last commands, and the actions that ended last, of every source."""

    def __init__(self, space: SharedSpace) -> None:
        self._utterances = space.ring_reader(topics.UTTERANCE, from_start=True)
        self._events = space.ring_reader(topics.TASK_EVENT, from_start=True)
        self._words: OrderedDict[str, str] = OrderedDict()
        self._ended: deque[ActionNote] = deque(maxlen=MOST_ACTIONS)

    @property
    def last_actions(self) -> tuple[ActionNote, ...]:
        """Return the actions that ended last, the newest first."""
        return tuple(reversed(self._ended))

    def step(self) -> None:
        """Take what has come in since the last time."""
        for said in self._utterances.drain():
            self._name(str(said.payload.get("command_id", "")), str(said.payload.get("text") or ""))
        for event in self._events.drain():
            self._follow(event.payload)

    def words_of(self, command_id: str) -> str:
        """Return what a command asks for, "" where that is not known."""
        return self._words.get(command_id, "")

    def _follow(self, event: TaskEvent) -> None:
        if event["event"] == "plan" and not self.words_of(event["command_id"]):
            self._name(event["command_id"], str(event["plan"].get("goal", "")))
        elif event["event"] == "action" and event["status"] in FINAL:
            note = ActionNote(
                skill=event["skill"],
                parameters=event["parameters"],
                status=event["status"],
                error=event["error"] or "",
            )
            self._ended.append(note)

    def _name(self, command_id: str, words: str) -> None:
        if command_id and words:
            self._words[command_id] = words
        while len(self._words) > _MOST_COMMANDS:
            self._words.popitem(last=False)
