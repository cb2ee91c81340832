"""Answer what agents ask about the robot and its world; nothing moves by it."""

import time
from collections.abc import Callable
from contextlib import closing
from functools import lru_cache
from typing import Any, Final

from drivers.clock import MonotonicClock
from platforms import load_profile
from vla_deploy.client.command_history import CommandHistory
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.mcp.errors import NoRobot
from vla_deploy.gateways.mcp.robot_access import RobotAccess
from vla_deploy.gateways.plan_preview import preview, preview_request
from vla_deploy.ipc import topics
from vla_deploy.memory import MemoryStore
from vla_deploy.planning.assembly import planner_for
from vla_deploy.planning.planner import Planner
from vla_deploy.plans.scene_report import scene_report
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.telemetry.folder import FlightFolder, folder_of
from vla_deploy.telemetry.recording.folder import RecordingFolder, recordings_dir_of
from vla_deploy.telemetry.robot_state import collect

MOST_EVENTS: Final = 40
"""Of one command, the newest."""
_FRESH_S: Final = 5.0
_DEFAULT_PROFILE: Final = "desktop"


class RobotReader:
    """Read for one thread of its own: planning and files take their time."""

    def __init__(
        self, access: RobotAccess, plan_by: Callable[[RobotDescription, str], Planner] | None = None
    ) -> None:
        """Begin; `plan_by` makes the planner of a robot and a profile, not the shipped one."""
        self._access = access
        self._plan_by = plan_by or self._shipped
        self._robot_of = lru_cache(maxsize=1)(load_robot)
        self._planner_of = lru_cache(maxsize=1)(self._open_planner)

    def state(self) -> dict[str, Any]:
        """Return the status of every process and of the lease, without the things around."""
        return collect(self._access.link()) | {"scene": "see the tool scene"}

    def scene(self, words: str) -> dict[str, Any]:
        """Return what is known of things.

        Raises:
            NoRobot: none runs, or perception is silent.
            WorldError: the words mean nothing.
        """
        link = self._access.link()
        document = link.document(topics.SCENE, _FRESH_S)
        if document is None:
            raise NoRobot("perception publishes no scene; ask for the state")
        robot = self._robot_of(self._robot_name(link))
        return scene_report(document, robot, link.clock.now_ns(), words)

    def plan(self, text: str) -> dict[str, Any]:
        """Return the plan for a command, or what the robot would ask, or why it would refuse."""
        link = self._access.link()
        robot = self._robot_name(link)
        status = link.document(topics.PROFILE_STATUS, _FRESH_S)
        planner = self._planner_of(robot, status["profile"] if status else _DEFAULT_PROFILE)
        return preview(planner, preview_request(text, self._robot_of(robot), link)).document()

    def memory(self, like: str, limit: int) -> list[dict[str, Any]]:
        """Return remembered commands: the newest, or those like some words.

        Raises:
            MemoryUnusable: the file cannot be read.
        """
        with closing(MemoryStore.of_base(self._access.base)) as store:
            if like:
                return [one.episode.document() for one in store.recall(like, limit)]
            return [one.document() for one in store.newest(limit)]

    def recordings(self, limit: int) -> dict[str, Any]:
        """Return the newest files of the recorder, by name."""
        base = self._access.base
        flights = FlightFolder(folder_of(base)).files()
        recorded = RecordingFolder(recordings_dir_of(base)).files()
        return {
            "flights": [path.name for path in reversed(flights)][:limit],
            "recordings": [path.name for path in reversed(recorded)][:limit],
        }

    def commands(self, command_id: str, limit: int) -> list[dict[str, Any]]:
        """Return one command with its newest events, or the newest ones without."""
        history = CommandHistory(self._access.link(), time.time_ns)
        newest, found = history.newest(limit), history.find(command_id)
        history.stop()
        if not command_id:
            return [{**one.document(), "events": len(one.events)} for one in newest]
        if found is None:
            return []
        document = found.document()
        return [{**document, "events": document["events"][-MOST_EVENTS:]}]

    def _robot_name(self, link: RobotLink) -> str:
        table = link.document(topics.PROCESS_TABLE, _FRESH_S)
        if table is None:
            raise NoRobot("the supervisor does not say which robot this is")
        return table["robot"]

    def _open_planner(self, robot: str, profile: str) -> Planner:
        return self._plan_by(self._robot_of(robot), profile)

    def _shipped(self, robot: RobotDescription, profile: str) -> Planner:
        return planner_for(robot, load_profile(profile), MonotonicClock(), self._access.base)
