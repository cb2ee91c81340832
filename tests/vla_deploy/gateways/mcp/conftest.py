"""A robot whose planner is real: agents call, the test is the executor and every person."""

import json
import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import anyio
import anyio.lowlevel
import pytest

from drivers.clock import NS_PER_S
from sim_twin.contracts.scripted import ManualClock
from vla_deploy.client.access.audit_log import AuditFile, AuditLog
from vla_deploy.client.agent_lease import LeaseKeeper
from vla_deploy.gateways.mcp.acting import RobotActs
from vla_deploy.gateways.mcp.calls import AgentCalls, AgentName, ToolAnswer
from vla_deploy.gateways.mcp.reading import RobotReader
from vla_deploy.gateways.mcp.robot_access import RobotAccess
from vla_deploy.ipc import SharedSpace
from vla_deploy.planning.node import PlannerNode
from vla_deploy.planning.planner import Planner
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.runtime.node import NodeContext
from vla_deploy.supervisor.runs.runtime import own_start_ticks

TESTER = AgentName(client="tester")


@cache
def butler() -> RobotDescription:
    return load_robot("butler")


class LeasedRobot:
    """Run the planner while an agent waits; every plan that it dispatches succeeds at once."""

    def __init__(self, folder: Path) -> None:
        self.clock = ManualClock(NS_PER_S)
        self.base = folder / "base"
        self.run_dir = self.base / "run"
        self.run_dir.mkdir(parents=True)
        owner = {"pid": os.getpid(), "start_ticks": own_start_ticks(), "run_id": "run"}
        (self.base / "lock").write_text(json.dumps({**owner, "run_dir": str(self.run_dir)}))
        self.space = SharedSpace(self.run_dir / "ipc", self.clock)
        self.lease = LeaseKeeper(self.space, self.clock)
        self.plans: list[dict[str, Any]] = []
        self.after_step: Callable[[], object] = lambda: None
        self._plans = self.space.ring_reader("plan", from_start=True)
        self._told = self.space.ring_writer("task_event")
        self._said = self.space.ring_writer("utterance")
        self.presses = self.space.ring_reader("operator", from_start=True)
        context = NodeContext(
            run_dir=self.run_dir,
            robot="butler",
            profile="desktop",
            devices_dir=None,
            clock=self.clock,
        )
        planner = Planner(self.clock, within_s=20.0)
        self.planner = PlannerNode(context, butler(), planner, wall_s=lambda: 1.75e9)
        self.planner.start()
        self.space.cell_writer("process_table").put_document({"robot": "butler"})
        self.audit_file = AuditFile(folder / "audit.jsonl")
        access = RobotAccess(self.base, self.clock)
        self.calls = AgentCalls(
            access,
            RobotActs(access, self._pause),
            RobotReader(RobotAccess(self.base, self.clock), lambda *_: planner),
            AuditLog(self.audit_file, self.clock),
        )
        self._control = self.space.cell_writer("control_status")
        self._scene = self.space.cell_writer("scene")
        self.sees("red cup", "blue cup")

    def sees(self, *things: str) -> None:
        """Let perception see cups in a row on the coffee table."""
        objects = [
            {"id": f"{name}_{number}", "class": name, "colour": colour,
             "position_m": [2.0 + 0.2 * number, 1.5, 0.5], "size_m": [0.07, 0.07, 0.1],
             "last_seen_ns": self.clock.now_ns(), "rests": {"relation": "on", "of": "coffee_table"}}
            for number, (colour, _, name) in enumerate(one.partition(" ") for one in things)
        ]  # fmt: skip
        self._objects = objects
        self._publish()

    def _publish(self) -> None:
        armed = {"state": "armed", "cause": "", "detail": "", "estop_latched": False}
        self._control.put_document(armed)
        self._scene.put_document({"stamp_ns": self.clock.now_ns(), "objects": self._objects})

    def call(self, name: str, agent: AgentName = TESTER, **arguments: Any) -> ToolAnswer:
        """Let an agent call a tool."""
        return anyio.run(self.calls.call, name, arguments, agent)

    def person(self, **utterance: Any) -> None:
        """Let a person say something."""
        self._said.publish({"command_id": "p1", "source": "cli", **utterance})
        self.step()

    def step(self) -> None:
        """Pass a moment."""
        self.clock.ns += NS_PER_S // 20
        self._publish()
        self.planner.step()
        self.after_step()
        for event in self._plans.drain():
            self.plans.append(event.payload)
            done = {"command_id": event.payload["command_id"], "event": "finished"}
            ended = {"success": True, "error": None, "actions": []}
            self._told.publish(done | ended)

    def audited(self) -> list[dict[str, Any]]:
        """Return the audit log, the newest first."""
        return self.audit_file.newest(100_000)

    def close(self) -> None:
        self.calls.close()
        self.planner.stop()
        self.space.close()

    async def _pause(self) -> None:
        await anyio.lowlevel.checkpoint()  # others may call meanwhile
        self.step()


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[LeasedRobot]:
    made = LeasedRobot(tmp_path)
    yield made
    made.close()


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[], LeasedRobot]]:
    """Make robots for tests with many examples."""
    made: list[LeasedRobot] = []

    def make() -> LeasedRobot:
        made.append(LeasedRobot(tmp_path_factory.mktemp("robot")))
        return made[-1]

    yield make
    for one in made:
        one.close()
