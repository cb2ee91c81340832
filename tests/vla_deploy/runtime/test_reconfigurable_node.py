from concurrent.futures import Executor, Future
from typing import Any

import pytest

from drivers.clock import MonotonicClock
from platforms import Profile, load_profile
from platforms.profile_source import read_source
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.executors import InlineExecutor, low_priority_thread
from vla_deploy.runtime.node import run_node
from vla_deploy.runtime.reconfigurable_node import TIER_RETRY_NS, ReconfigurableNode


class StepClock:
    def __init__(self) -> None:
        self.ns = 0

    def now_ns(self) -> int:
        return self.ns

    def sleep_until(self, deadline_ns: int) -> None:
        self.ns = max(self.ns, deadline_ns)


class Host:
    def obstacles(self, profile: Profile) -> tuple[str, ...]:
        return ()

    def apply(self, profile: Profile) -> tuple[str, ...]:
        return ()


class Plain:
    period_s = 0.1

    def start(self) -> None: ...

    def step(self) -> None: ...

    def stop(self) -> None: ...


class WithModels(Plain):
    def __init__(self) -> None:
        self.model = "tier 0"
        self.loaded = ["tier 0"]
        self.is_broken = False

    def prepare(self, profile: Profile, model_tier: int) -> str:
        if self.is_broken:
            raise FileNotFoundError("small.onnx")
        self.loaded.append(f"tier {model_tier}")
        return f"tier {model_tier}"

    def commit(self, prepared: str) -> str:
        before, self.model = self.model, prepared
        return before

    def discard(self, prepared: str) -> None:
        self.loaded.remove(prepared)


class Later(Executor):
    """Do work when the test says so."""

    def __init__(self) -> None:
        self.work: list[tuple[Future[Any], Any]] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> "Future[Any]":
        future: Future[Any] = Future()
        self.work.append((future, lambda: fn(*args, **kwargs)))
        return future

    def do(self) -> None:
        for future, act in self.work:
            future.set_result(act())
        self.work.clear()


@pytest.fixture
def clock() -> StepClock:
    return StepClock()


@pytest.fixture
def adapted(tmp_path, clock):
    def adapted(
        node: Plain, name: str = "planner", executor: Executor | None = None
    ) -> ReconfigurableNode:
        wrapped = ReconfigurableNode(
            name,
            node,
            load_profile("desktop"),
            ipc=tmp_path,
            clock=clock,
            host=Host(),
            executor=executor or InlineExecutor(),
        )
        wrapped.start()
        return wrapped

    return adapted


@pytest.fixture
def direct(tmp_path):
    cell = SharedSpace(tmp_path, StepClock()).cell_writer("resource_directives")

    def direct(rate_ratio: dict[str, float], model_tier: dict[str, int]) -> None:
        cell.put_document({"rate_ratio": rate_ratio, "model_tier": model_tier, "suspended": []})

    return direct


@pytest.fixture
def change(tmp_path):
    """Return a way to tell a change to the same profile, read anew."""
    ring = SharedSpace(tmp_path, StepClock()).ring_writer("profile_change")
    values = read_source("desktop").values

    def change(phase: str) -> None:
        ring.publish({"change_id": 1, "phase": phase, "profile": "desktop", "values": values})

    return change


def test_a_slowed_process_steps_less_often_and_then_as_before(adapted, direct):
    node = adapted(Plain())
    direct({"planner": 0.5}, {})
    node.step()
    assert node.period_s == 0.2
    direct({"executor": 0.5}, {})
    node.step()
    assert node.period_s == 0.1


def test_a_node_that_can_do_its_costly_work_more_seldom_is_told_so(adapted, direct):
    inner = Plain()
    told: list[float] = []
    inner.slow = told.append
    node = adapted(inner)
    for ratio in (0.5, 1.0):
        direct({"planner": ratio}, {})
        node.step()
    assert told == [0.5, 1.0]


def test_control_is_never_slowed(adapted, direct):
    node = adapted(Plain(), "control")
    direct({"control": 0.5}, {"control": 1})
    node.step()
    assert node.period_s == 0.1


def test_a_smaller_model_is_prepared_aside_and_taken_between_two_steps(adapted, direct):
    inner, executor = WithModels(), Later()
    node = adapted(inner, executor=executor)
    direct({}, {"planner": 1})
    node.step()
    assert inner.model == "tier 0", "it goes on with the old one while the new one is loaded"
    executor.do()
    assert inner.model == "tier 0", "never in the middle of a step"
    node.step()
    assert (inner.model, inner.loaded) == ("tier 1", ["tier 1"])
    direct({}, {})
    node.step()
    executor.do()
    node.step()
    assert (inner.model, inner.loaded) == ("tier 0", ["tier 0"])


def test_a_model_that_cannot_be_loaded_leaves_the_old_one_and_says_so(adapted, direct, caplog):
    inner = WithModels()
    inner.is_broken = True
    node = adapted(inner)
    direct({}, {"planner": 1})
    node.step()
    assert (inner.model, inner.loaded) == ("tier 0", ["tier 0"])
    assert "degraded: no models of tier 1: small.onnx" in caplog.text


def test_what_could_not_be_loaded_is_tried_again_after_a_while(adapted, direct, clock):
    inner = WithModels()
    node = adapted(inner)
    direct({}, {"planner": 1})
    node.step()
    node.step()
    inner.is_broken = True
    direct({}, {})
    node.step()
    node.step()
    assert inner.model == "tier 1"
    inner.is_broken = False
    node.step()
    assert inner.model == "tier 1", "not with each step"
    clock.ns += TIER_RETRY_NS
    node.step()
    node.step()
    assert (inner.model, inner.loaded) == ("tier 0", ["tier 0"])


def test_a_tier_that_was_loaded_for_another_profile_is_discarded_and_loaded_anew(
    adapted, direct, change
):
    inner, executor = WithModels(), Later()
    node = adapted(inner, executor=executor)
    direct({}, {"planner": 1})
    node.step()
    change("prepare")
    node.step()
    executor.do()
    node.step()
    assert inner.model == "tier 0", "not in the middle of a change"
    change("commit")
    node.step()
    change("keep")
    node.step()
    assert node.profile.name == "desktop"
    assert (inner.model, inner.loaded) == ("tier 0", ["tier 0"])
    node.step()
    executor.do()
    node.step()
    assert (inner.model, inner.loaded) == ("tier 1", ["tier 1"])


def test_a_node_without_models_follows_any_tier(adapted, direct):
    node = adapted(Plain())
    direct({}, {"planner": 2})
    node.step()
    node.step()
    assert node.profile.name == "desktop"


def test_work_in_the_background_gets_its_result_or_its_error():
    with low_priority_thread(MonotonicClock()) as pool:
        assert pool.submit(lambda: 7).result(timeout=10) == 7
        assert isinstance(pool.submit(lambda: 1 / 0).exception(timeout=10), ZeroDivisionError)


def test_a_changed_period_goes_on_from_the_last_deadline():
    clock = StepClock()

    class Node(Plain):
        def __init__(self) -> None:
            self.steps_ns: list[int] = []

        def step(self) -> None:
            self.steps_ns.append(clock.ns)
            clock.ns += 1_000_000  # a step takes a while, and moves no deadline
            self.period_s = 0.004 if len(self.steps_ns) < 3 else 0.01

    node = Node()
    run_node(node, clock, lambda: len(node.steps_ns) == 5)
    assert [ns // 1_000_000 for ns in node.steps_ns] == [0, 4, 8, 18, 28]
