"""Hold the ODrive bus to what is its own: watchdog, endpoints, firmware, units."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from drivers.errors import DeviceMissing, NoReply, ProtocolError, WrongDevice
from drivers.odrive import EMULATED_ENDPOINTS, AxisSpec, ODriveBus
from drivers.odrive.axis_port import AxisPort
from drivers.odrive.codec import (
    MESSAGES,
    AxisError,
    AxisState,
    OdriveCommand,
    can_id,
    decode,
    encode,
    split_id,
)
from drivers.odrive.endpoints import (
    ENABLE_WATCHDOG,
    ENCODER_RATE,
    RAMP_RATE,
    VELOCITY_LIMIT,
    WATCHDOG_TIMEOUT,
    read_endpoints,
)
from drivers.odrive.faults import AxisFault
from drivers.wheel_drives.bus import PowerState, ResetRule
from sim_twin.can import MemoryBus
from sim_twin.can.odrive.axis import _REACTIONS
from sim_twin.can.odrive.meters import ODriveMeters


def with_endpoints(bench: Any, path: Path) -> ODriveBus:
    return ODriveBus(
        MemoryBus(bench.world.wire), bench.world, [AxisSpec(node_id=0, joint="left")], path
    )


def written(tmp_path: Path, change: Any) -> Path:
    document = json.loads(EMULATED_ENDPOINTS.read_text())
    change(document)
    path = tmp_path / "endpoints.json"
    path.write_text(json.dumps(document))
    return path


def test_the_watchdog_is_armed_with_the_heartbeat_time(odrive: Any) -> None:
    odrive.bus.connect()
    for axis in odrive.axes:
        assert axis.properties.read(ENABLE_WATCHDOG)
        assert axis.properties.read(WATCHDOG_TIMEOUT) == pytest.approx(0.1)
        assert axis.properties.read(RAMP_RATE) == pytest.approx(20.0 / 6.2831853, rel=1e-6)


def test_a_watchdog_that_does_not_arm_is_refused(odrive: Any) -> None:
    write = odrive.axes[1].properties.write
    odrive.axes[1].properties.write = lambda name, value: write(
        name, 0.0 if name == ENABLE_WATCHDOG else value
    )
    with pytest.raises(WrongDevice, match=r"right .*enable_watchdog is 0 after 1 was written"):
        odrive.bus.connect()


def test_a_file_of_another_firmware_is_refused_before_anything_is_written(
    odrive: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(odrive.axes[0], "_version", (2, 4, 4, 58, 0, 6, 10, 0))
    with pytest.raises(WrongDevice, match=r"firmware 0\.6\.10, but .* is of 0\.0\.0"):
        odrive.bus.connect()
    assert not odrive.axes[0].properties.read(ENABLE_WATCHDOG)


def test_a_missing_endpoint_file_says_where_to_get_it(odrive: Any, tmp_path: Path) -> None:
    with pytest.raises(DeviceMissing, match="vendor's release page"):
        with_endpoints(odrive, tmp_path / "none.json").connect()


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"endpoints": {"a": 1}, "fw_version": "1"}'])
def test_a_file_that_is_no_endpoint_file_is_refused(odrive: Any, tmp_path: Path, text: str) -> None:
    path = tmp_path / "endpoints.json"
    path.write_text(text)
    with pytest.raises(WrongDevice, match=r"no flat_endpoints|lacks"):
        with_endpoints(odrive, path).connect()


def test_a_file_without_the_watchdog_is_refused(odrive: Any, tmp_path: Path) -> None:
    path = written(tmp_path, lambda document: document["endpoints"].pop(ENABLE_WATCHDOG))
    with pytest.raises(WrongDevice, match="watchdog cannot be armed"):
        with_endpoints(odrive, path).connect()


def test_without_the_rate_endpoint_estimates_are_asked_for(odrive: Any, tmp_path: Path) -> None:
    odrive.axes[0].properties.write(ENCODER_RATE, 0.0)
    bus = with_endpoints(
        odrive, written(tmp_path, lambda document: document["endpoints"].pop(ENCODER_RATE))
    )
    bus.connect()
    assert any(ENCODER_RATE in note for note in bus.notes)
    for _ in range(20):
        state = bus.cycle(None)
        odrive.pause(0.004)
    assert state.healthy
    assert state.age_s[0] < 0.01
    bus.close()


def test_an_axis_that_was_never_calibrated_says_what_to_do(
    odrive: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ODriveMeters, "position_rev", property(lambda meters: math.nan))
    with pytest.raises(WrongDevice, match="calibrate"):
        odrive.bus.connect()


def test_an_axis_that_calibrates_is_cancelled_by_connecting_and_not_ready_in_operation(
    odrive: Any,
) -> None:
    calibrate = encode(OdriveCommand.SET_AXIS_STATE, AxisState.FULL_CALIBRATION_SEQUENCE)
    odrive.axes[0]._react(OdriveCommand.SET_AXIS_STATE, calibrate)
    odrive.bus.connect()
    assert odrive.powered() == [False, False]
    odrive.run(0.1)
    odrive.axes[0]._react(OdriveCommand.SET_AXIS_STATE, calibrate)
    odrive.pause(0.03)
    state = odrive.bus.cycle(None)
    assert state.power_state == (PowerState.NOT_READY, PowerState.SWITCH_ON_DISABLED)
    state = odrive.run(0.2)
    assert state.power_state[0] is PowerState.SWITCH_ON_DISABLED
    assert state.healthy


@pytest.mark.parametrize("size", [7, 8])
def test_heartbeats_of_seven_and_of_eight_bytes_are_read(size: int) -> None:
    port = AxisPort(AxisSpec(node_id=0, joint="left"), 100_000_000)
    values = (AxisError.ESTOP_REQUESTED, AxisState.ANTICOGGING_CALIBRATION, 1, 1)
    port.take(OdriveCommand.HEARTBEAT, encode(OdriveCommand.HEARTBEAT, *values)[:size], 0)
    assert (port.errors, port.axis_state) == values[:2]


def test_an_axis_without_an_sdo_answer_is_never_enabled(
    odrive: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(_REACTIONS, OdriveCommand.RX_SDO, lambda *ignored: None)
    with pytest.raises(NoReply, match="the watchdog cannot be verified"):
        odrive.bus.connect()


def test_limits_are_written_where_the_robot_file_gives_a_current(odrive: Any) -> None:
    specs = [AxisSpec(node_id=0, joint="left", current_limit_a=7.5, velocity_limit_rad_s=12.0)]
    bus = ODriveBus(MemoryBus(odrive.world.wire), odrive.world, specs, EMULATED_ENDPOINTS)
    bus.connect()
    axis = odrive.axes[0]
    assert axis.properties.read(VELOCITY_LIMIT) == pytest.approx(12.0 / math.tau)
    assert axis._stage.current_limit_a == pytest.approx(7.5)
    bus.close()


def test_an_error_that_is_the_operators_outlives_a_new_connection(odrive: Any) -> None:
    odrive.fail(1)
    odrive.bus.connect()
    assert odrive.run(0.5).faulted == (False, True)
    assert odrive.bus.reset_fault() == ()
    assert odrive.run(0.5).healthy


@pytest.mark.parametrize("node_id", [-1, 0x3F])
def test_a_node_id_that_no_axis_can_have_is_refused(node_id: int) -> None:
    with pytest.raises(ValueError, match="node_id"):
        AxisSpec(node_id=node_id, joint="left")


@pytest.mark.parametrize("command", list(OdriveCommand))
def test_every_message_takes_its_own_bytes_and_padding_only(command: OdriveCommand) -> None:
    data = bytes(8)
    assert len(decode(command, data)) == len(MESSAGES[command].signals)
    with pytest.raises(ProtocolError, match="9 bytes"):
        decode(command, bytes(9))


def test_units_are_revolutions_and_identifiers_carry_the_node() -> None:
    assert encode(OdriveCommand.SET_INPUT_VEL, 1.0, 0.0).hex() == "0000803f00000000"
    assert can_id(3, OdriveCommand.SET_AXIS_STATE) == 0x67
    assert split_id(0x67) == (3, OdriveCommand.SET_AXIS_STATE)
    assert encode(OdriveCommand.SET_AXIS_STATE, AxisState.CLOSED_LOOP_CONTROL) == b"\x08\0\0\0"


@pytest.mark.parametrize(
    ("code", "rule"),
    [
        (AxisError.WATCHDOG_TIMER_EXPIRED, ResetRule.AUTOMATIC),
        (AxisError.ESTOP_REQUESTED, ResetRule.OPERATOR),
        (AxisError.WATCHDOG_TIMER_EXPIRED | AxisError.MOTOR_OVER_TEMP, ResetRule.OPERATOR),
        (AxisError.DRV_FAULT | AxisError.MOTOR_OVER_TEMP, ResetRule.NEVER),
        (1 << 31, ResetRule.OPERATOR),
    ],
)
def test_the_strictest_error_decides_who_may_clear(code: int, rule: ResetRule) -> None:
    assert AxisFault(code=int(code)).rule is rule


def test_errors_are_described_in_words() -> None:
    fault = AxisFault(code=int(AxisError.MOTOR_OVER_TEMP) | 1 << 31)
    assert fault.text == "0x80002000 motor over temp, undocumented bits 0x80000000"


def test_the_shipped_endpoints_are_of_no_real_firmware() -> None:
    assert read_endpoints(EMULATED_ENDPOINTS).firmware == "0.0.0"


def test_an_axis_that_rebooted_in_between_is_lost_until_reconnected(odrive: Any) -> None:
    odrive.bus.connect()
    odrive.bus.enable()
    assert odrive.run(0.3).enabled
    odrive.axes[0].set_supply(on=False)
    odrive.axes[0].set_supply(on=True)
    assert not odrive.axes[0].properties.read(ENABLE_WATCHDOG)
    state = odrive.run(0.3)
    assert state.lost == (True, False)
    odrive.bus.enable()
    assert not odrive.run(0.3, (1.0, 1.0)).enabled
    assert odrive.powered() == [False, False]
    odrive.bus.connect()
    assert odrive.run(0.2).healthy


def test_no_axis_is_powered_before_its_watchdog_is_confirmed(odrive: Any) -> None:
    odrive.bus.connect()
    odrive.run(0.1)
    odrive.axes[1].properties.write(ENABLE_WATCHDOG, 0.0)
    odrive.bus.enable()
    powered = False
    for _ in range(75):
        odrive.run(0.0)
        odrive.pause(0.004)
        powered = powered or odrive.powered()[1]
    assert not powered
    assert odrive.run(0.0).lost == (False, True)


def test_an_axis_that_was_silent_too_long_stays_lost(odrive: Any) -> None:
    odrive.bus.connect()
    odrive.run(0.1)
    odrive.axes[0].silence(on=True)
    odrive.run(0.2)
    odrive.axes[0].silence(on=False)
    assert odrive.run(0.2).lost == (True, False)


def test_cutting_the_power_sends_the_emergency_stop_which_holds_until_a_reset(odrive: Any) -> None:
    odrive.bus.connect()
    odrive.bus.enable()
    odrive.run(0.5, (5.0, 5.0))
    odrive.bus.cut_power()
    assert odrive.powered() == [False, False]
    assert all(axis.errors & AxisError.ESTOP_REQUESTED for axis in odrive.axes)
    state = odrive.run(0.1)
    assert state.faulted == (True, True)
    assert "estop requested" in state.fault[0].text
    odrive.bus.enable()
    assert not odrive.run(0.2).enabled
    assert odrive.bus.reset_fault() == ()
    odrive.run(0.1)
    odrive.bus.enable()
    assert odrive.run(0.3).enabled
