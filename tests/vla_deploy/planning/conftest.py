"""A time that only the test moves, and a world with two cups on a table."""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from benchmarks.planner_corpus import home, scenes
from benchmarks.planner_session import PlannerSession, fresh_session
from drivers.clock import NS_PER_S, MonotonicClock
from platforms import Profile, load_profile
from vla_deploy.client.access.audit_log import AuditLog
from vla_deploy.ipc import SharedSpace
from vla_deploy.memory import MemoryStore
from vla_deploy.missions.store import MissionStore
from vla_deploy.planning.assembly import open_planner
from vla_deploy.planning.interfaces import BackEnd, PlanRequest, Proposal
from vla_deploy.planning.node import PlannerNode
from vla_deploy.planning.planner import Planner, checked
from vla_deploy.plans.knowledge import world_of
from vla_deploy.plans.plan import Plan
from vla_deploy.robots import RobotDescription, load_robot
from vla_deploy.runtime.deadline import Deadline
from vla_deploy.runtime.executors import InlineExecutor
from vla_deploy.runtime.node import NodeContext
from vla_deploy.world import Snapshot, Thing

SERVERS = """
[servers.bench]
api = "openai_compatible"
url = "{url}"
model = "tiny"
location = "local"
max_attempts = 1

[servers.cloud]
api = "openai"
url = "https://example.com/v1"
model = "large"
location = "remote"
credential = "no_such_key_anywhere"
"""


@cache
def butler() -> RobotDescription:
    """Return the robot of these tests, which is read once."""
    return load_robot("butler")


class StepClock:
    def __init__(self) -> None:
        self.time_ns = NS_PER_S

    def now_ns(self) -> int:
        return self.time_ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.time_ns = deadline_ns

    def pass_s(self, duration_s: float) -> None:
        self.time_ns += round(duration_s * NS_PER_S)


class ScriptedBackEnd(BackEnd):
    """Does the next of what it was told: propose a plan, raise, or take its time."""

    def __init__(self, name: str, clock: StepClock, *script: Any, takes_s: float = 0.0) -> None:
        self.name = name
        self.asked: list[PlanRequest] = []
        self._clock = clock
        self._script = list(script)
        self._takes_s = takes_s

    def propose(self, request: PlanRequest, deadline: Deadline) -> Proposal:
        self.asked.append(request)
        self._clock.pass_s(self._takes_s)
        said = self._script.pop(0) if len(self._script) > 1 else self._script[0]
        if isinstance(said, Exception):
            raise said
        return said


class Later(Executor):
    """Does what it is given when the test says so, as a thread may."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[Future[Any], Callable[[], Any]]] = deque()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self._waiting.append((future, lambda: fn(*args, **kwargs)))
        return future

    def do_one(self) -> None:
        future, work = self._waiting.popleft()
        future.set_result(work())


class Desk:
    """Hold the other ends of the planner's topics."""

    def __init__(
        self,
        run_dir: Path,
        clock: StepClock,
        *slow: Any,
        executor: Executor,
        check: Any = checked,
        memory: MemoryStore | None = None,
    ) -> None:
        self.clock = clock
        self._check = check
        self.executor = executor
        self.memory = memory
        self.audit: AuditLog | None = None
        self.robot = butler()
        self.space = SharedSpace(run_dir / "ipc", clock)
        self._context = NodeContext(
            run_dir=run_dir, robot="butler", profile="desktop", devices_dir=None, clock=clock
        )
        self._slow = slow
        self._given = 0
        self.carried_out = ["another"]
        self._utterances = self.space.ring_writer("utterance")
        self._events = self.space.ring_reader("task_event", from_start=True)
        self._plans = self.space.ring_reader("plan", from_start=True)
        self._control = self.space.cell_writer("control_status")
        self._status = self.space.cell_reader("planner_status")
        self._scene = self.space.cell_writer("scene")
        self._executor = self.space.ring_writer("task_event")
        self._executor_status = self.space.cell_writer("executor_status")
        self._voice = self.space.ring_reader("say", from_start=True)
        self.planner = self.start()

    def start(self) -> PlannerNode:
        """Start a planner; one that is there already is left as it was when it was killed."""
        planner = Planner(self.clock, self._slow, within_s=20.0, check=self._check)
        self.planner = PlannerNode(
            self._context,
            self.robot,
            planner,
            self.executor,
            self.memory,
            missions=MissionStore(self._context.run_dir / "missions.json"),
            wall_s=self.wall_s,
            audit=self.audit,
        )
        self.planner.start()
        return self.planner

    def wall_s(self) -> float:
        """Return Unix seconds, which go by the desk's clock."""
        return 1_750_000_000.0 + self.clock.now_ns() / NS_PER_S

    def missions(self) -> list[dict[str, Any]]:
        """Return the missions as the planner shows them, the newest first."""
        sample = self.space.cell_reader("missions").latest()
        assert sample is not None
        return sample.document()["missions"]

    def control(self, state: str) -> None:
        self._control.put_document({"state": state, "cause": "", "detail": ""})

    def executor_is(
        self, state: str, doing: tuple[str, str] | None = None, **holding: str | None
    ) -> None:
        """Let the executor tell what it is `doing`, command and skill, and what the hands hold."""
        commands = [] if state == "idle" else self.carried_out
        command_id, skill = doing or (None, None)
        told = {"command_id": command_id, "skill": skill, "commands": commands}
        self._executor_status.put_document({"state": state, "holding": holding, **told})

    def sees(self, *names: str) -> None:
        """Let perception tell of things such as "red cup_1", in a row on the coffee table."""
        objects = [
            {"id": name, "class": name.partition("_")[0], "colour": colour,
             "position_m": [2.0 + 0.2 * number, 1.5, 0.5], "size_m": [0.07, 0.07, 0.1],
             "last_seen_ns": self.clock.now_ns(), "rests": {"relation": "on", "of": "coffee_table"}}
            for number, (colour, name) in enumerate(one.split() for one in names)
        ]  # fmt: skip
        self.shows(*objects)

    def shows(self, *objects: dict[str, Any], **rest: Any) -> None:
        """Let perception tell of things as they are in its document."""
        now_ns = self.clock.now_ns()
        self._scene.put_document({"stamp_ns": now_ns, "objects": list(objects)} | rest)

    def give(self, **utterance: object) -> None:
        """Give an utterance; those without an id are c1, c2 and so on."""
        self._given += 1
        named = {"command_id": f"c{self._given}", "source": "test"}
        self._utterances.publish(named | utterance)

    def executor_tells(self, **event: object) -> None:
        self._executor.publish(event)

    def ends(self, command_id: str) -> None:
        """Let the executor tell that a command has succeeded."""
        self.executor_tells(command_id=command_id, event="finished", success=True, error=None)

    def answers_to(self, text: str | None = None, **utterance: object) -> list[dict[str, Any]]:
        """Give an utterance, and return the events of the planner's next step."""
        self.give(**({} if text is None else {"text": text}) | utterance)
        return self.answers()

    def plans_for(self, text: str | None = None, **utterance: object) -> list[dict[str, Any]]:
        """Give an utterance, and return what the planner hands to the executor."""
        self.answers_to(text, **utterance)
        return self.plans()

    def answers(self) -> list[dict[str, Any]]:
        self.planner.step()
        return self.told()

    def told(self) -> list[dict[str, Any]]:
        return [event.payload for event in self._events.drain()]

    def said_aloud(self) -> list[str]:
        return [event.payload["text"] for event in self._voice.drain()]

    def plans(self) -> list[dict[str, Any]]:
        return [event.payload for event in self._plans.drain()]

    def status(self) -> dict[str, Any]:
        self.clock.pass_s(0.5)
        self.planner.step()
        sample = self._status.latest()
        assert sample is not None
        return sample.document()

    def close(self) -> None:
        self.planner.stop()
        self.space.close()


@pytest.fixture
def open_desk(tmp_path: Path, clock: StepClock) -> Iterator[Callable[..., Desk]]:
    """Open a desk with an armed robot and a planner that asks these slow back ends after rules."""
    opened: list[Desk] = []

    def open_desk(
        *slow: Any,
        executor: Executor | None = None,
        check: Any = checked,
        memory: MemoryStore | None = None,
    ) -> Desk:
        desk = Desk(
            tmp_path,
            clock,
            *slow,
            executor=executor or InlineExecutor(),
            check=check,
            memory=memory,
        )
        opened.append(desk)
        desk.control("armed")
        return desk

    yield open_desk
    for desk in opened:
        desk.close()


@pytest.fixture
def desk(open_desk: Callable[..., Desk]) -> Desk:
    """Open a desk whose planner has patterns alone."""
    return open_desk()


@pytest.fixture
def session_in() -> Iterator[Callable[[str], PlannerSession]]:
    """Open a session with the shipped planner, in a scene of the corpus."""
    with ExitStack() as opened:

        def session_in(scene: str) -> PlannerSession:
            session = opened.enter_context(fresh_session())
            session.tell(scenes()[scene].world(home()))
            return session

        yield session_in


@pytest.fixture
def flat(session_in: Callable[[str], PlannerSession]) -> PlannerSession:
    return session_in("tidy")


@pytest.fixture
def profile_of(tmp_path: Path, loopback: Any) -> Callable[..., Profile]:
    """Write a profile with this table, for a runtime directory whose servers are these."""

    def profile_of(planning: str, url: str = loopback.url) -> Profile:
        config = tmp_path / "base-config"
        config.mkdir(exist_ok=True)
        (config / "servers.toml").write_text(SERVERS.format(url=url))
        profile = tmp_path / "mine.toml"
        profile.write_text(f'inherits = "desktop"\n[planning]\n{planning}\n')
        return load_profile(profile)

    return profile_of


@pytest.fixture
def open_with(tmp_path: Path, profile_of: Callable[..., Profile]) -> Callable[..., Planner]:
    """Open the planner of a profile with this table, and with these parsers on board."""

    def open_with(planning: str, *on_board: BackEnd, **changes: str) -> Planner:
        settings = profile_of(planning, **changes).planning
        return open_planner(butler(), settings, MonotonicClock(), tmp_path / "base", on_board)

    return open_with


@pytest.fixture
def later() -> Later:
    return Later()


@pytest.fixture
def clock() -> StepClock:
    return StepClock()


@pytest.fixture
def back_end(clock: StepClock) -> Callable[..., ScriptedBackEnd]:
    return lambda name, *script, takes_s=0.0: ScriptedBackEnd(name, clock, *script, takes_s=takes_s)


@pytest.fixture(scope="session")
def thing() -> Callable[..., Thing]:
    def thing(name: str, colour: str = "red", **changes: Any) -> Thing:
        kind = name.partition("_")[0]
        told = {"position_m": (2.0, 1.5, 0.5), "size_m": (0.07, 0.07, 0.1)} | changes
        return Thing(thing_id=name, kind=kind, colour=colour, **told)

    return thing


@pytest.fixture(scope="session")
def scene(thing: Callable[..., Thing]) -> Snapshot:
    return Snapshot(stamp_ns=NS_PER_S, things=(thing("cup_1"), thing("cup_2", "blue")))


@pytest.fixture(scope="session")
def ask(scene: Snapshot) -> Callable[..., PlanRequest]:
    """Return a request to butler about that world, some values replaced."""

    def ask(text: str, holding: dict[str, str | None] | None = None, **changes: Any) -> PlanRequest:
        world = world_of(butler(), holding or {"left": None, "right": None})
        told = {"command_id": "c1", "text": text, "world": world, "scene": scene}
        return PlanRequest(**(told | {"here": (0.0, 0.0, 0.0)} | changes))

    return ask


@pytest.fixture(scope="session")
def propose() -> Callable[..., Proposal]:
    """Return a proposal of one action after the other, each a skill with its parameters."""

    def propose(
        *steps: tuple[str, dict[str, Any]], back_end: str = "model", **changes: Any
    ) -> Proposal:
        actions = [
            {"id": f"a{number}", "skill": skill, "parameters": parameters}
            for number, (skill, parameters) in enumerate(steps)
        ]
        plan = Plan.model_validate({"goal": "a test", "actions": actions})
        return Proposal(**({"plan": plan, "back_end": back_end, "confidence": 0.9} | changes))

    return propose
