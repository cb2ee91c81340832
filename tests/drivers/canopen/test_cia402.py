import pytest
from canopen.profiles.p402 import State402
from hypothesis import given
from hypothesis import strategies as st

from drivers.canopen.cia402 import (
    STATUSWORD_PATTERNS,
    ControlCommand,
    DriveGoal,
    PowerState,
    controlword_for,
    decode_statusword,
)
from sim_twin.can.cia402.power_state_machine import STATE_BITS, PowerStateMachine


@given(st.integers(0, 0xFFFF))
def test_every_statusword_reads_as_the_vendor_neutral_library_reads_it(word: int) -> None:
    names = {name for name, (mask, bits) in State402.SW_MASK.items() if word & mask == bits}
    state = decode_statusword(word)
    assert names == (set() if state is PowerState.UNKNOWN else {state.value.upper()})


@given(st.integers(0, 0xFFFF))
def test_patterns_exclude_each_other(word: int) -> None:
    assert sum(word & mask == bits for mask, bits, _ in STATUSWORD_PATTERNS) <= 1


@pytest.mark.parametrize("state", list(PowerState))
def test_only_the_goal_enabled_ever_sends_an_enabling_command(state: PowerState) -> None:
    for goal in set(DriveGoal) - {DriveGoal.ENABLED}:
        assert controlword_for(goal, state) in {
            ControlCommand.DISABLE_VOLTAGE,
            ControlCommand.QUICK_STOP,
            ControlCommand.FAULT_RESET,
        }


def test_a_fault_is_never_reset_on_the_way_to_enabled() -> None:
    assert controlword_for(DriveGoal.ENABLED, PowerState.FAULT) is ControlCommand.DISABLE_VOLTAGE


@pytest.mark.parametrize("state", list(STATE_BITS))
def test_the_emulated_statusword_says_its_state(state: PowerState) -> None:
    assert decode_statusword(STATE_BITS[state]) is state


@pytest.mark.parametrize(
    ("source", "target"),
    [pair for pair in State402.TRANSITIONTABLE if State402.TRANSITIONTABLE[pair]],
)
def test_the_emulated_machine_makes_every_transition_of_the_standard(
    source: str, target: str
) -> None:
    staying_quick_stop = 6
    machine = PowerStateMachine()
    machine.state = PowerState(source.lower())
    machine.command(State402.TRANSITIONTABLE[source, target], staying_quick_stop)
    assert machine.state is PowerState(target.lower())


@given(st.lists(st.tuples(st.booleans(), st.sampled_from([0x00, 0x06, 0x0F, 0x80, 0x8F]))))
def test_only_a_rising_reset_bit_leaves_a_fault(steps: list[tuple[bool, int]]) -> None:
    machine = PowerStateMachine()
    machine.initialise()
    previous = 0
    for fails, word in steps:
        if fails:
            machine.fail(0)
        was_fault = machine.state is PowerState.FAULT
        cleared = machine.command(word, 2)
        assert cleared == (was_fault and bool(word & ~previous & 0x80))
        assert (machine.state is PowerState.FAULT) == (was_fault and not cleared)
        previous = word
