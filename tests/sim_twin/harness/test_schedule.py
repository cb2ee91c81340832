import pytest

from sim_twin.harness.lockstep import Schedule
from sim_twin.timing.clock import SimClock

MS = 1_000_000


class FakeSimulation:
    def __init__(self) -> None:
        self.now_ns = 0

    def step(self) -> None:
        self.now_ns += 2 * MS


class Device:
    def __init__(self) -> None:
        self.closed = False

    def close(self) -> None:
        self.closed = True


class RecordingNode:
    def __init__(
        self, name: str, period_s: float, simulation: FakeSimulation, log: list[str]
    ) -> None:
        self.period_s = period_s
        self._name = name
        self._simulation = simulation
        self._log = log

    def start(self) -> None:
        self._note("start")

    def step(self) -> None:
        self._note("step")

    def stop(self) -> None:
        self._note("stop")

    def _note(self, what: str) -> None:
        self._log.append(f"{self._name} {what} {self._simulation.now_ns // MS}")


class OpeningNode(RecordingNode):
    def __init__(self, simulation: FakeSimulation, opened: list[Device]) -> None:
        super().__init__("opening", 0.01, simulation, [])
        self.device = Device()
        self._opened = opened

    def start(self) -> None:
        self._opened.append(self.device)


class SlowNode(RecordingNode):
    def step(self) -> None:
        super().step()
        SimClock(self._simulation).sleep_until(self._simulation.now_ns + 10 * MS)


@pytest.fixture
def simulation() -> FakeSimulation:
    return FakeSimulation()


@pytest.fixture
def log() -> list[str]:
    return []


def test_waiting_steps_the_simulation_to_the_first_step_not_before_the_deadline(
    simulation: FakeSimulation,
) -> None:
    clock = SimClock(simulation)
    clock.sleep_until(5 * MS)
    assert clock.now_ns() == 6 * MS
    clock.sleep_until(0)
    assert clock.now_ns() == 6 * MS


def test_nodes_step_at_their_own_periods_in_order_of_arrival(
    simulation: FakeSimulation, log: list[str]
) -> None:
    schedule = Schedule(simulation)
    schedule.add(RecordingNode("fast", 0.004, simulation, log))
    schedule.add(RecordingNode("slow", 0.008, simulation, log))
    schedule.run_until(lambda: False, 0.01)
    assert log == [
        "fast start 0",
        "slow start 0",
        "fast step 0",
        "slow step 0",
        "fast step 4",
        "fast step 8",
        "slow step 8",
    ]


def test_a_node_that_overruns_skips_the_periods_it_missed(
    simulation: FakeSimulation, log: list[str]
) -> None:
    schedule = Schedule(simulation)
    schedule.add(SlowNode("late", 0.004, simulation, log))
    schedule.run_until(lambda: False, 0.03)
    assert log == ["late start 0", "late step 0", "late step 10", "late step 20"]


def test_running_ends_as_soon_as_the_predicate_holds(simulation: FakeSimulation) -> None:
    schedule = Schedule(simulation)
    assert schedule.run_until(lambda: simulation.now_ns >= 6 * MS, 0.1)
    assert simulation.now_ns == 6 * MS


def test_a_predicate_that_never_holds_ends_at_the_deadline(simulation: FakeSimulation) -> None:
    assert not Schedule(simulation).run_until(lambda: False, 0.006)
    assert simulation.now_ns == 6 * MS


def test_a_removed_node_is_stopped(simulation: FakeSimulation, log: list[str]) -> None:
    schedule = Schedule(simulation)
    node = RecordingNode("node", 0.002, simulation, log)
    schedule.add(node)
    schedule.remove(node)
    schedule.run_until(lambda: False, 0.01)
    assert log == ["node start 0", "node stop 0"]


def test_a_killed_node_is_never_called_again(simulation: FakeSimulation, log: list[str]) -> None:
    schedule = Schedule(simulation)
    node = RecordingNode("node", 0.002, simulation, log)
    schedule.add(node)
    schedule.kill(node)
    schedule.run_until(lambda: False, 0.01)
    assert log == ["node start 0"]


def test_killing_a_node_closes_what_it_had_opened_and_nothing_else(
    simulation: FakeSimulation,
) -> None:
    opened: list[Device] = []
    schedule = Schedule(simulation, opened)
    first, second = OpeningNode(simulation, opened), OpeningNode(simulation, opened)
    schedule.add(first)
    schedule.add(second)
    schedule.kill(second)
    assert (first.device.closed, second.device.closed) == (False, True)


def test_killing_a_node_that_does_not_run_is_refused(simulation: FakeSimulation) -> None:
    with pytest.raises(KeyError, match="does not run"):
        Schedule(simulation).kill(RecordingNode("node", 0.002, simulation, []))


def test_stopping_all_goes_backwards(simulation: FakeSimulation, log: list[str]) -> None:
    schedule = Schedule(simulation)
    schedule.add(RecordingNode("first", 0.002, simulation, log))
    schedule.add(RecordingNode("second", 0.002, simulation, log))
    schedule.stop()
    assert log[2:] == ["second stop 0", "first stop 0"]
    assert schedule.nodes == ()
