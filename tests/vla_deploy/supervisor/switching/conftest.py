"""Give the tests robots whose nodes follow a profile switch: the twin, and one without devices."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import NS_PER_S, Clock
from platforms import Profile, ProfileError, load_profile
from platforms.power_switch import PowerSwitch
from sim_twin.contracts.scripted import ManualClock
from sim_twin.harness.lockstep import Lockstep
from vla_deploy.control.node import ControlNode
from vla_deploy.ipc import SharedSpace
from vla_deploy.planning.node import PlannerNode
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.node import NeedsRestart, Node
from vla_deploy.runtime.reconfigurable_node import ReconfigurableNode
from vla_deploy.skills.node import ExecutorNode
from vla_deploy.supervisor.profiles.profile_change import Member
from vla_deploy.supervisor.profiles.profile_choice import ProfileChoice
from vla_deploy.supervisor.profiles.profile_switch import ProfileSwitch


class Kernel:
    """Grant or refuse what a profile wants of the kernel; a test may not change its own process."""

    def __init__(self) -> None:
        self.refusals: dict[str, str] = {}
        self.applied: list[str] = []

    def obstacles(self, profile: Profile) -> tuple[str, ...]:
        return tuple(text for name, text in self.refusals.items() if name == profile.name)

    def apply(self, profile: Profile) -> tuple[str, ...]:
        self.applied.append(profile.name)
        return ()


class Worker:
    """Be a node without devices that holds what it has prepared."""

    period_s = 0.05

    def __init__(self) -> None:
        self.steps = 0
        self.content = "first"
        self.alive = {"first"}
        self.refusal: Exception | None = None
        self.is_slow = False

    def start(self) -> None: ...

    def stop(self) -> None: ...

    def step(self) -> None:
        self.steps += 1

    def prepare(self, profile: Profile, model_tier: int) -> str:
        if self.refusal is not None:
            raise self.refusal
        content = f"{profile.name} {model_tier} after step {self.steps}"
        self.alive.add(content)
        return content

    def commit(self, prepared: str) -> str:
        before, self.content = self.content, prepared
        if self.is_slow:
            self.period_s = 0.001
        return before

    def discard(self, prepared: str) -> None:
        self.alive.remove(prepared)


class Supervision:
    """Step the switch as the supervisor does."""

    period_s = 0.05

    def __init__(self, switch: ProfileSwitch, members: dict[str, Member]) -> None:
        self.switch = switch
        self.members = members
        self.absent: dict[str, str] = {}
        self.restarts: list[str] = []

    def start(self) -> None: ...

    def step(self) -> None:
        self.restarts += self.switch.step(self.members, self.absent)

    def stop(self) -> None:
        self.switch.close()


class ProfileClient:
    """Ask for profiles as the command line does, and read what comes of it."""

    def __init__(self, space: SharedSpace, run_until: Callable[[Callable[[], bool], float], bool]):
        self._requests = space.ring_writer("profile_request")
        self._status = space.cell_reader("profile_status")
        self._run_until = run_until
        self._number = 0

    def request(self, profile: str, **options: bool) -> str:
        self._number += 1
        request_id = f"request {self._number}"
        self._requests.publish({"request_id": request_id, "profile": profile, **options})
        return request_id

    def use(self, profile: str, **options: bool) -> dict[str, Any]:
        """Ask for a profile and return how that ended."""
        request_id = self.request(profile, **options)
        assert self._run_until(lambda: self.last.get("request_id") == request_id, 60.0)
        return self.last

    @property
    def status(self) -> dict[str, Any]:
        sample = self._status.latest()
        return sample.document() if sample is not None else {}

    @property
    def last(self) -> dict[str, Any]:
        last: dict[str, Any] = self.status.get("last", {})
        return last


def reconfigurable(
    name: str,
    node: Node,
    profile: Profile,
    ipc: Path,
    clock: Clock,
    kernel: Kernel,
    executor: Executor,
) -> ReconfigurableNode:
    return ReconfigurableNode(
        name, node, profile, ipc=ipc, clock=clock, host=kernel, executor=executor
    )


class Bench:
    """Hold four nodes without devices and the switch; every node steps every 50 ms."""

    def __init__(self, folder: Path, profile: str) -> None:
        self.clock = ManualClock(NS_PER_S)
        self.ipc = folder / "ipc"
        self.space = SharedSpace(self.ipc, self.clock)
        self.control_status = self.space.cell_writer("control_status")
        self.table = self.space.cell_writer("process_table")
        self.directives = self.space.cell_writer("resource_directives")
        self.client = ProfileClient(self.space, self.run_until)
        self.choice = ProfileChoice(folder / "state" / "profile.json")
        self.root = folder / "root"
        self.late_ticks = 0
        self.state = "armed"
        self.dead: set[str] = set()
        self.workers = {name: Worker() for name in ("control", "perception", "planner", "executor")}
        self.kernels = {name: Kernel() for name in self.workers}
        self.executors: dict[str, Executor] = {name: InlineExecutor() for name in self.workers}
        self.nodes: dict[str, ReconfigurableNode] = {}
        for name in self.workers:
            self.start(name, profile)
        self.adopted: list[tuple[str, set[str]]] = []
        """The profile that was told to be in force each time, and those that nodes then had."""
        self.supervision = self.supervise(profile)
        self._ticks = 0

    def start(self, name: str, profile: str) -> None:
        """Start a process, also anew."""
        self.nodes[name] = reconfigurable(
            name,
            self.workers[name],
            load_profile(profile),
            self.ipc,
            self.clock,
            self.kernels[name],
            self.executors[name],
        )
        self.nodes[name].start()

    def supervise(
        self, profile: str, fault: str = "", executor: Executor | None = None
    ) -> Supervision:
        switch = ProfileSwitch(
            profile,
            load_profile(profile),
            self.space,
            self.clock,
            self.choice,
            PowerSwitch(self.root, (str(self.root / "nvpmodel"),)),
            executor or InlineExecutor(),
            on_change=lambda adopted: self.adopted.append((adopted.name, self.names())),
            fault=fault,
        )
        members = {name: Member(pid=1, started_under=profile) for name in self.nodes}
        return Supervision(switch, members)

    def tick(self) -> None:
        self._ticks += 1
        self.clock.ns += NS_PER_S // 20
        self.control_status.put_document(
            {"state": self.state, "tick": 12 * self._ticks, "late_ticks": self.late_ticks}
        )
        self.supervision.step()
        for name, node in self.nodes.items():
            if name not in self.dead:
                node.step()

    def run_until(self, predicate: Callable[[], bool], timeout_s: float) -> bool:
        until_ns = self.clock.ns + round(timeout_s * NS_PER_S)
        while not predicate():
            if self.clock.ns >= until_ns:
                return False
            self.tick()
        return True

    def reach(self, phase: str) -> None:
        assert self.run_until(lambda: self.client.status.get("phase") == phase, 60.0)

    def names(self) -> set[str]:
        """Return the profiles that the nodes run under."""
        return {node.profile.name for node in self.nodes.values()}


class TwinRig:
    """Hold the twin, control, planner and executor, and the switch, in lock-step."""

    def __init__(self, folder: Path, profile: str) -> None:
        self.lockstep = step = Lockstep(tmp_path=folder)
        ipc, declared = folder / "ipc", load_profile(profile)
        space = SharedSpace(ipc, step.clock)
        self.client = ProfileClient(space, step.run_until)
        self.joints = space.cell_reader("joint_state")
        self._control_status = space.cell_reader("control_status")
        self._operator = space.ring_writer("operator")
        self._commands = space.ring_writer("motion_command")
        self.control = ControlNode(step.context, step.robot, declared, step.devices)
        nodes: dict[str, Node] = {
            "control": self.control,
            "planner": PlannerNode(step.context, step.robot),
            "executor": ExecutorNode(step.context, step.robot, declared.executor_rate_hz),
        }
        for name, node in nodes.items():
            step.add(
                reconfigurable(name, node, declared, ipc, step.clock, Kernel(), InlineExecutor())
            )
        switch = ProfileSwitch(
            profile,
            declared,
            space,
            step.clock,
            ProfileChoice(folder / "state" / "profile.json"),
            PowerSwitch(folder / "root"),
            InlineExecutor(),
            watch_s=0.1,
        )
        members = {name: Member(pid=1, started_under=profile) for name in nodes}
        step.add(Supervision(switch, members))

    @property
    def control_status(self) -> dict[str, Any]:
        sample = self._control_status.latest()
        assert sample is not None
        return sample.document()

    def arm(self) -> None:
        """Arm, and lift the hands off the base."""
        self.lockstep.run_for(2.5)
        self._operator.publish({"act": "arm", "source": "test", "reason": ""})
        assert self.lockstep.run_until(lambda: self.control_status["state"] == "armed", 3.0)
        self.go(1, **self.lockstep.robot.poses["tuck"])
        self.lockstep.run_for(0.1)
        assert self.lockstep.run_until(lambda: not self.control_status["active_motions"], 10.0)

    def go(self, motion_id: int, **targets: float) -> None:
        self._commands.publish(
            {"kind": "goal", "motion_id": motion_id, "targets": targets, "speed_ratio": 1.0}
        )


@pytest.fixture
def profiles(tmp_path: Path) -> dict[str, str]:
    """Write two profiles that differ in what may change in motion; return their paths."""
    for name, rate_hz in {"swift": 250, "calm": 125}.items():
        rates = f"control_rate_hz = {rate_hz}\nexecutor_rate_hz = {rate_hz / 5}\n"
        (tmp_path / f"{name}.toml").write_text(f'inherits = "desktop"\n{rates}')
    return {name: str(tmp_path / f"{name}.toml") for name in ("swift", "calm")}


@pytest.fixture
def bench(tmp_path: Path, profiles: dict[str, str]) -> Bench:
    return Bench(tmp_path, profiles["swift"])


@pytest.fixture
def rig(tmp_path: Path, profiles: dict[str, str]) -> Iterator[TwinRig]:
    rig = TwinRig(tmp_path, profiles["swift"])
    yield rig
    rig.lockstep.close()


@pytest.fixture(params=["refuses", "needs a restart", "crashes", "may not"])
def hinder(request: pytest.FixtureRequest) -> Callable[[Bench, str], str]:
    """Return what keeps a process of a bench from preparing `calm`; it returns the reason."""

    def hinder(bench: Bench, name: str) -> str:
        if request.param == "may not":
            bench.kernels[name].refusals["calm"] = "no SCHED_FIFO priority 40"
            return "needs a restart: no SCHED_FIFO priority 40; permit it with --allow-restart"
        errors = {
            "refuses": (ProfileError(("the model is not there",)), "the model is not there"),
            "needs a restart": (
                NeedsRestart("servos"),
                "needs a restart: servos; permit it with --allow-restart",
            ),
            "crashes": (RuntimeError("out of memory"), "out of memory"),
        }
        bench.workers[name].refusal, reason = errors[request.param]
        return reason

    return hinder
