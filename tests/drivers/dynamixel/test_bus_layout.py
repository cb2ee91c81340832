"""With indirect addresses one read brings voltage, temperature, torque, error and watchdog too."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivers.dynamixel import BlockLayout, ServoSpec, WatchdogState
from drivers.dynamixel.tables.layout import DIRECT, block_of
from drivers.dynamixel.tables.model import IndirectBank
from drivers.dynamixel.tables.models import MODELS
from drivers.dynamixel.wire.codec import Instruction, encode_instruction
from drivers.servo.errors import WrongServo
from drivers.servo.hardware_error import HardwareError
from sim_twin.servos import EmulatedServoSpec, FirmwareOptions

MakeBench = Callable[..., Any]
MIXED = ("XM430-W350", "XL330-M288", "2XL430-W250", "XC330-T288")


def connected(make_bench: MakeBench, count: int = 4, **options: Any) -> Any:
    bench = make_bench(count, **{"layout": BlockLayout.INDIRECT, "fast_sync": None} | options)
    bench.bus.connect()
    bench.cycle()
    return bench


def mixed(make_bench: MakeBench, firmware: int, **options: Any) -> Any:
    specs = [
        ServoSpec(id=n, model_name=name, joint=f"joint_{n}") for n, name in enumerate(MIXED, 1)
    ]
    servos = [
        EmulatedServoSpec(id=spec.id, model_name=spec.model_name, firmware_version=firmware)
        for spec in specs
    ]
    return connected(make_bench, specs=specs, servos=servos, **options)


def test_one_read_brings_all_in_the_first_cycle_and_nothing_else_is_asked(
    make_bench: MakeBench,
) -> None:
    bench = connected(make_bench)
    bench.wire.sent.clear()
    bench.cycle(50)
    state = bench.bus.state
    assert state.valid.all()
    assert np.abs(state.voltage_v - 12.0).max() < 0.1
    assert (state.temperature_c > 20).all()
    assert bench.wire.count(Instruction.FAST_SYNC_READ) == len(bench.wire.sent) == 50


def test_both_layouts_read_the_same_motion(make_bench: MakeBench) -> None:
    values = []
    for layout in (BlockLayout.DIRECT, BlockLayout.INDIRECT):
        bench = connected(make_bench, layout=layout)
        bench.rotors._damping[:] = 0.0
        bench.rotors.position_rad[:] = [0.5, -0.5, 1.0, -1.0]
        bench.rotors.velocity_rad_s[:] = [-1.0, 2.0, 0.0, 1.0]
        bench.cycle()
        values.append(bench.bus.state.readings[:3].copy())
    assert np.array_equal(*values)
    assert np.abs(values[0][1]).max() > 0.9


def test_an_alert_and_its_cause_need_no_further_question(make_bench: MakeBench) -> None:
    bench = connected(make_bench)
    bench.bank.set_alert(2, HardwareError.OVERLOAD)
    bench.wire.sent.clear()
    bench.cycle()
    assert bench.bus.state.alert.tolist() == [False, True, False, False]
    assert bench.bus.state.error[1] == HardwareError.OVERLOAD
    assert len(bench.wire.sent) == 1


def test_torque_and_a_tripped_watchdog_show_in_the_same_cycle(make_bench: MakeBench) -> None:
    bench = connected(make_bench)
    bench.bus.enable_torque()
    bench.cycle()
    assert bench.bus.state.torque_on.all()
    assert (bench.bus.state.watchdog == 5).all()
    bench.run(0.2)
    bench.bus.read_state()
    assert bench.bus.watchdog is WatchdogState.TRIPPED
    bench.bus.clear_watchdog()
    bench.bus.disable_torque()
    bench.cycle()
    assert not bench.bus.state.torque_on.any()
    assert bench.bus.watchdog is WatchdogState.OFF


@pytest.mark.parametrize(("firmware", "reads"), [(52, 3), (53, 2)])
def test_servos_whose_block_lies_elsewhere_are_read_by_a_request_of_their_own(
    make_bench: MakeBench, firmware: int, reads: int
) -> None:
    bench = mixed(make_bench, firmware)
    bench.wire.sent.clear()
    bench.rotors.position_rad[:] = [0.1, 0.2, 0.3, 0.4]
    bench.cycle()
    assert np.abs(bench.bus.state.position_rad - [0.1, 0.2, 0.3, 0.4]).max() < 0.01
    assert bench.bus.state.valid.all()
    assert len(bench.wire.sent) == reads
    assert bench.wire.count(Instruction.SYNC_READ) == 1  # the twin servo has no fast one
    assert bench.wire.count(Instruction.FAST_SYNC_READ) == reads - 1


def test_fast_sync_read_is_refused_where_it_is_demanded_and_not_to_be_had(
    make_bench: MakeBench,
) -> None:
    with pytest.raises(WrongServo, match=r"servo 3 .* no fast sync read; set fast_sync = false"):
        mixed(make_bench, 53, fast_sync=True)


def test_a_dead_servo_in_one_group_costs_the_other_groups_nothing(make_bench: MakeBench) -> None:
    bench = mixed(make_bench, 52)
    bench.bank.silence(3)
    bench.cycle(10)
    assert bench.bus.state.valid.tolist() == [True, True, False, True]
    assert bench.bus.counters.suspensions == 1


def test_a_servo_that_has_forgotten_its_map_is_not_believed_and_is_set_up_again(
    make_bench: MakeBench,
) -> None:
    bench = connected(make_bench, options=FirmwareOptions(reboot_s=0.0))
    bench.bus.enable_torque()
    bench.rotors.position_rad[:] = 1.0
    bench.cycle()
    before = bench.bus.state.copy()
    bench.wire.receive(encode_instruction(2, Instruction.REBOOT))
    bench.wire.transmit()
    bench.bus.read_state()
    state = bench.bus.state
    assert state.valid.tolist() == [True, False, True, True]
    assert np.array_equal(state.readings[:, 1], before.readings[:, 1])
    assert not state.torque_on[1]
    bench.cycle(10)
    assert state.valid.all()
    assert state.torque_on.tolist() == [True, False, True, True]
    assert bench.bank.register(2, "torque_enable") == 0
    assert bench.bus.counters.returns == 1
    assert bench.bus.notices[-1] == (
        "servo 2 (joint_2, XM430-W350): answers again; torque is off until it is armed anew; "
        "indirect addresses at 168"
    )


def test_a_power_cycled_servo_rejoins_without_torque_and_says_so(make_bench: MakeBench) -> None:
    bench = connected(make_bench)
    bench.bus.enable_torque()
    bench.wire.receive(encode_instruction(2, Instruction.REBOOT))
    bench.wire.transmit()
    for _ in range(200):
        bench.cycle()
        assert bench.bus.state.valid[[0, 2, 3]].all()
    assert bench.bus.state.valid.all()
    assert bench.bus.state.torque_on.tolist() == [True, False, True, True]
    assert "torque is off" in bench.bus.notices[-1]


def test_a_servo_whose_cable_wobbled_keeps_torque_and_setup(make_bench: MakeBench) -> None:
    bench = connected(make_bench)
    bench.bus.enable_torque()
    bench.bank.silence(2)
    bench.cycle(5)
    bench.bank.silence(2, silent=False)
    bench.cycle(60)
    assert bench.bus.state.valid.all()
    assert bench.bus.state.torque_on.all()
    assert bench.bus.notices[-1] == "servo 2 (joint_2, XM430-W350): answers again"


def test_connecting_again_finds_the_map_and_writes_nothing(make_bench: MakeBench) -> None:
    bench = connected(make_bench)
    writes = bench.wire.count(Instruction.WRITE)
    setups = bench.new_bus().connect()
    assert bench.wire.count(Instruction.WRITE) == writes
    assert all(setup.written == () for setup in setups)


def test_the_block_is_chosen_by_model_firmware_and_layout() -> None:
    model = MODELS["XL330-M288"]
    assert block_of(model, 52, BlockLayout.AUTO).address == 208
    assert block_of(model, 53, BlockLayout.AUTO).address == 224
    assert block_of(model, 53, BlockLayout.DIRECT) is DIRECT
    assert len(block_of(model, 53, BlockLayout.INDIRECT).map_bytes) == 32


def test_a_servo_with_too_few_slots_is_read_directly_or_refused() -> None:
    poor = replace(MODELS["XM430-W350"], indirect=((1, (IndirectBank(168, 224, 8),)),))
    assert block_of(poor, 48, BlockLayout.AUTO) is DIRECT
    with pytest.raises(ValueError, match="has no 16 indirect slots; set the layout to direct"):
        block_of(poor, 48, BlockLayout.INDIRECT)
