from sim_twin.timing.clock import SimClock


class CountingSimulation:
    def __init__(self) -> None:
        self.now_ns = 0

    def step(self) -> None:
        self.now_ns += 2_000_000


def test_waiting_steps_the_simulation_to_the_first_step_not_before_the_deadline() -> None:
    simulation = CountingSimulation()
    clock = SimClock(simulation)
    clock.sleep_until(5_000_000)
    assert clock.now_ns() == 6_000_000


def test_a_deadline_that_has_passed_moves_nothing() -> None:
    simulation = CountingSimulation()
    SimClock(simulation).sleep_until(0)
    assert simulation.now_ns == 0
