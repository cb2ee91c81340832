"""Each command must be seen to end, without waiting for a planner that was away."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import NS_PER_S
from sim_twin.campaigns.talk import CommandTalk
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.client.link import RobotLink


class Room:
    """Hold both ends of a talk."""

    def __init__(self, folder: Path) -> None:
        self.clock = ManualClock(NS_PER_S)
        self.link = RobotLink(folder, self.clock, source="cli")
        self.space = self.link.space
        self._heard = self.space.ring_reader("utterance", from_start=False)
        self._events = self.space.ring_writer("task_event")
        self.talk = CommandTalk(self.link)

    def say(self, text: str) -> str:
        self.talk.say(text)
        (event,) = self._heard.drain()
        assert event.payload["text"] == text
        return str(event.payload["command_id"])

    def answer(self, command_id: str, event: str, **more: bool) -> None:
        self._events.publish({"command_id": command_id, "event": event, **more})
        self.talk.listen()


@pytest.fixture
def room(tmp_path: Path) -> Iterator[Room]:
    room = Room(tmp_path)
    yield room
    room.link.close()


def test_a_command_goes_on_until_its_own_end(room: Room) -> None:
    mine = room.say("look left")
    room.answer("another", "finished", success=True)
    room.answer(mine, "accepted")
    room.clock.ns += 100 * NS_PER_S
    assert room.talk.is_busy
    room.answer(mine, "finished", success=True)
    assert not room.talk.is_busy
    assert (room.talk.done, room.talk.failed) == (1, 0)


@pytest.mark.parametrize(("event", "more"), [("finished", {"success": False}), ("rejected", {})])
def test_what_did_not_succeed_counts_as_failed(
    room: Room, event: str, more: dict[str, bool]
) -> None:
    room.answer(room.say("look left"), event, **more)
    assert not room.talk.is_busy
    assert (room.talk.done, room.talk.failed) == (0, 1)


def test_a_command_without_an_answer_does_not_block(room: Room) -> None:
    room.say("look left")
    room.clock.ns += 7 * NS_PER_S
    assert room.talk.is_busy
    room.clock.ns += 2 * NS_PER_S
    assert not room.talk.is_busy
