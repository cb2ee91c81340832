"""Stop the robot, and give it commands in an agent's name; what the robot makes of them is told."""

from collections.abc import Awaitable, Callable
from typing import Any, Final, Unpack

import anyio

from drivers.clock import NS_PER_S
from vla_deploy.client.acts import REACHED, why_not
from vla_deploy.client.following import Following
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.mcp.errors import CallRefused, NoRobot
from vla_deploy.gateways.mcp.robot_access import RobotAccess
from vla_deploy.ipc import topics
from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.payloads.tasks import TaskEvent, UtteranceContent
from vla_deploy.ipc.stop_button import ESTOP

STOP_WITHIN_S: Final = 6.0
"""So long a stop's answer is waited for: the robot stops by itself whether anybody waits or not."""
_LOOK_S: Final = 0.05
_GOES_ON: Final = "goes on; ask for it: commands with its command_id"
_PERSON_ANSWERS: Final = (
    "a person must answer this, at the page, by voice or by: vla-deploy say --answer; an agent's "
    "answer is refused, and so are its other commands until then; stop drops the question"
)

Pause = Callable[[], Awaitable[None]]


async def _look_again() -> None:
    await anyio.sleep(_LOOK_S)


class RobotActs:
    """Give commands and stops on the event loop; `pause` waits between two looks."""

    def __init__(self, access: RobotAccess, pause: Pause = _look_again) -> None:
        self._access = access
        self._pause = pause

    async def command(
        self, sender: str, wait_s: float, **content: Unpack[UtteranceContent]
    ) -> dict[str, Any]:
        """Give a command, and return its id, how it stands, and what was published of it.

        Raises:
            NoRobot: none runs, or planner and executor do not answer.
            CallRefused: it is longer than a command may be.
        """
        link = self._access.link()
        events = link.events(topics.TASK_EVENT)
        try:
            command_id = link.utter(source=sender, **content)
        except (BadPayload, RecursionError, ValueError) as error:
            raise CallRefused("bad_arguments", f"too long or no JSON: {error}") from error
        following = Following(
            command_id,
            lambda: link.fresh(topics.PLANNER_STATUS, age_limit_s=2.0),
            lambda: link.fresh(topics.EXECUTOR_STATUS, age_limit_s=1.0),
            link.clock,
        )
        told: list[TaskEvent] = []
        until_ns = link.clock.now_ns() + round(wait_s * NS_PER_S)
        while not (_is_over(following, told) or link.clock.now_ns() >= until_ns):
            await self._pause()
            told += following.look(events)
            if following.is_unanswered:
                raise NoRobot("planner and executor do not answer; nothing is carried out")
        events.close()
        return {"command_id": command_id, **_standing(told), "events": [*told]}

    async def stop(self, sender: str) -> dict[str, Any]:
        """End all that goes on; the robot comes to rest and stays ready."""
        return await self.command(sender, STOP_WITHIN_S, cancel=True)

    async def estop(self, sender: str, reason: str) -> dict[str, Any]:
        """Press the software stop, which latches until a person resets it."""
        link = self._access.link()
        link.operate(ESTOP, reason, sender)
        until_ns = link.clock.now_ns() + round(STOP_WITHIN_S * NS_PER_S)
        while (shown := _shown(link)) is None and link.clock.now_ns() < until_ns:
            await self._pause()
        status = link.document(topics.CONTROL_STATUS, age_limit_s=1.0)
        return {
            "pressed": True,
            "state": shown or why_not(status),
            "advice": "a person releases it: vla-deploy reset, then vla-deploy arm",
        }


def _shown(link: RobotLink) -> str | None:
    status = link.document(topics.CONTROL_STATUS, age_limit_s=1.0)
    return str(status["state"]) if status is not None and REACHED[ESTOP](status) else None


def _is_over(following: Following, told: list[TaskEvent]) -> bool:
    return following.has_ended or (bool(told) and told[-1]["event"] == "asked")


def _standing(told: list[TaskEvent]) -> dict[str, Any]:
    """Return how a command stands by its newest event, in a word and with advice."""
    last = told[-1] if told else None
    if last is None:
        return {"state": "given", "advice": _GOES_ON}
    if last["event"] == "asked":
        return {"state": "asked", "question": last["question"], "advice": _PERSON_ANSWERS}
    if last["event"] == "rejected":
        return {"state": "rejected", "reason": last["reason"]}
    if last["event"] == "finished":
        state = "succeeded" if last["success"] else "failed"
        return {"state": state, "reason": last["error"] or ""}
    return {"state": "active", "advice": _GOES_ON}
