"""Build two small worlds in lock-step: CiA 402 drives and ODrive axes, each with free wheels."""

import math
from collections.abc import Callable
from typing import Any

import can
import numpy as np
import pytest

from drivers.canopen import DriveSpec, WheelDriveBus
from drivers.drive_bus import DriveBus, DriveState
from drivers.odrive import EMULATED_ENDPOINTS, AxisSpec, ODriveBus
from drivers.odrive.codec import AxisError, AxisState, Command, can_id, decode, encode, split_id
from drivers.odrive.endpoints import (
    ENABLE_WATCHDOG,
    ENCODER_RATE,
    HEARTBEAT_RATE,
    RAMP_RATE,
    WATCHDOG_TIMEOUT,
    read_endpoints,
)
from sim_twin.can import CanWire, MemoryBus, WheelDrive
from sim_twin.can.free_wheel import FreeWheel, FreeWheelWorld

TICK_NS = 4_000_000
HEARTBEAT_S = 0.1
STEP_NS = 1_000_000


class WireAxis:
    """Answer as the vendor documents an axis to answer; its wheel follows the ramp exactly."""

    def __init__(self, node_id: int, sign: int = 1) -> None:
        self.node_id = node_id
        self.sign = sign
        self.supplied = True
        self.state = AxisState.IDLE
        self.errors = AxisError(0)
        self.disarm_reason = AxisError(0)
        self.firmware = (0, 0, 0)
        self.calibrated = True
        self.velocity_rev_s = 0.0
        self.position_rev = 0.0
        self.input_rev_s = 0.0
        self.values: dict[int, bytes] = {
            each.number: bytes(4) for each in read_endpoints(EMULATED_ENDPOINTS).endpoints.values()
        }
        self.set_value(HEARTBEAT_RATE, 100)
        self.set_value(ENCODER_RATE, 10)
        self.set_value(RAMP_RATE, 10.0)
        self.deaf_values: set[str] = set()
        self.now_ns = 0
        self.fed_ns = 0
        self._due_ns = {Command.HEARTBEAT: 0, Command.GET_ENCODER_ESTIMATES: 0}
        self._send: Callable[[can.Message], None] = lambda frame: None

    def value(self, name: str) -> float:
        endpoint = read_endpoints(EMULATED_ENDPOINTS).endpoints[name]
        return endpoint.decode(self.values[endpoint.number])

    def set_value(self, name: str, value: float) -> None:
        endpoint = read_endpoints(EMULATED_ENDPOINTS).endpoints[name]
        self.values[endpoint.number] = endpoint.encode(value)

    @property
    def velocity_rad_s(self) -> float:
        return self.sign * self.velocity_rev_s * math.tau

    def connect(self, send: Callable[[can.Message], None]) -> None:
        self._send = send

    def disarm(self, reason: AxisError) -> None:
        self.errors |= reason
        self.disarm_reason |= reason
        self.state = AxisState.IDLE

    def step(self, now_ns: int, dt_s: float) -> None:
        self.now_ns = now_ns
        if not self.supplied:
            return
        timeout_ns = self.value(WATCHDOG_TIMEOUT) * 1e9
        if self.value(ENABLE_WATCHDOG) and now_ns - self.fed_ns > timeout_ns:
            self.disarm(AxisError.WATCHDOG_TIMER_EXPIRED)
        if self.state is AxisState.CLOSED_LOOP_CONTROL:
            step = self.value(RAMP_RATE) * dt_s
            error = self.input_rev_s - self.velocity_rev_s
            self.velocity_rev_s += min(max(error, -step), step)
        else:
            self.velocity_rev_s *= 1.0 - 0.2 * dt_s
        self.position_rev += self.velocity_rev_s * dt_s
        rates = {Command.HEARTBEAT: HEARTBEAT_RATE, Command.GET_ENCODER_ESTIMATES: ENCODER_RATE}
        for command, rate in rates.items():
            if now_ns >= self._due_ns[command] and self.value(rate):
                self._due_ns[command] = now_ns + round(self.value(rate) * 1e6)
                self.tell(command)

    def tell(self, command: Command) -> None:
        position = self.position_rev if self.calibrated else math.nan
        answers: dict[Command, Callable[[], tuple[Any, ...]]] = {
            Command.HEARTBEAT: lambda: (int(self.errors), int(self.state), 0, 0),
            Command.GET_ERROR: lambda: (int(self.errors), int(self.disarm_reason)),
            Command.GET_ENCODER_ESTIMATES: lambda: (position, self.velocity_rev_s),
            Command.GET_VERSION: lambda: (2, 4, 4, 58, *self.firmware, 0),
            Command.GET_TORQUES: lambda: (0.5, 0.25),
            Command.GET_TEMPERATURE: lambda: (31.0, 32.0),
            Command.GET_BUS_VOLTAGE_CURRENT: lambda: (24.0, 1.5),
            Command.GET_IQ: lambda: (0.0, 2.5),
        }
        if command in answers:
            self.put(command, encode(command, *answers[command]()))

    def put(self, command: Command, data: bytes) -> None:
        self._send(
            can.Message(
                arbitration_id=can_id(self.node_id, command), is_extended_id=False, data=data
            )
        )

    def receive(self, frame: can.Message) -> None:
        node_id, number = split_id(frame.arbitration_id)
        if node_id != self.node_id or not self.supplied:
            return
        if frame.is_remote_frame:
            self.tell(Command(number))
            return
        self.fed_ns = self.now_ns
        match Command(number), decode(Command(number), bytes(frame.data)):
            case Command.SET_INPUT_VEL, (velocity, _):
                self.input_rev_s = float(velocity)
            case Command.SET_AXIS_STATE, (state,):
                wanted = AxisState(int(state))
                if wanted is AxisState.IDLE or not self.errors:
                    self.state = wanted
            case Command.CLEAR_ERRORS, _:
                self.errors = self.disarm_reason = AxisError(0)
            case Command.RX_SDO, (opcode, endpoint, value):
                assert isinstance(value, bytes)
                self.on_sdo(int(opcode), int(endpoint), value)

    def on_sdo(self, opcode: int, endpoint: int, value: bytes) -> None:
        names = {
            each.number: name for name, each in read_endpoints(EMULATED_ENDPOINTS).endpoints.items()
        }
        if opcode == 0:
            self.put(Command.TX_SDO, encode(Command.TX_SDO, endpoint, self.values[endpoint]))
        elif names[endpoint] not in self.deaf_values:
            self.values[endpoint] = value


class AxisWorld:
    """Be a clock whose waiting turns the axes' wheels."""

    def __init__(self, *axes: WireAxis) -> None:
        self.axes = axes
        self.wire = CanWire(axes)
        self._now_ns = 1_000_000_000

    def now_ns(self) -> int:
        return self._now_ns

    def sleep_until(self, deadline_ns: int) -> None:
        while self._now_ns < deadline_ns:
            self._now_ns += STEP_NS
            for axis in self.axes:
                axis.step(self._now_ns, STEP_NS / 1e9)
            self.wire.poll(self._now_ns)


class Bench:
    """Hold a world and its driver, whichever protocol they speak."""

    world: FreeWheelWorld | AxisWorld
    bus: DriveBus

    def run(self, duration_s: float, velocity: tuple[float, float] | None = None) -> DriveState:
        wanted = None if velocity is None else np.array(velocity)
        state = self.bus.cycle(wanted)
        for _ in range(round(duration_s * 1e9) // TICK_NS):
            self.pause(TICK_NS / 1e9)
            state = self.bus.cycle(wanted)
        return state

    def pause(self, duration_s: float) -> None:
        self.world.sleep_until(self.world.now_ns() + round(duration_s * 1e9))

    def cut_plug(self) -> None:
        self.world.wire.cut = True

    def speeds(self) -> list[float]:
        raise NotImplementedError

    def powered(self) -> list[bool]:
        raise NotImplementedError

    def kill(self, row: int) -> None:
        raise NotImplementedError

    def fail(self, row: int) -> None:
        raise NotImplementedError

    def break_down(self, row: int) -> None:
        raise NotImplementedError


class Cia402Bench(Bench):
    def __init__(self) -> None:
        self.world = FreeWheelWorld([FreeWheel(WheelDrive(1)), FreeWheel(WheelDrive(2, sign=-1))])
        specs = [DriveSpec(node_id=1, joint="left"), DriveSpec(node_id=2, joint="right", sign=-1)]
        self.bus = WheelDriveBus(MemoryBus(self.world.wire), self.world, specs, HEARTBEAT_S)
        self.drives = [wheel.drive for wheel in self.world.wheels]
        self.wheels = self.world.wheels

    def speeds(self) -> list[float]:
        return [wheel.velocity_rad_s for wheel in self.wheels]

    def powered(self) -> list[bool]:
        return [
            drive.power_state.value in ("operation enabled", "quick stop active")
            for drive in self.drives
        ]

    def kill(self, row: int) -> None:
        self.drives[row].set_supply(on=False)

    def fail(self, row: int) -> None:
        self.drives[row].raise_fault(0x4310, 0x09)

    def break_down(self, row: int) -> None:
        self.drives[row].raise_fault(0x2340, 0x03)


class ODriveBench(Bench):
    def __init__(self) -> None:
        self.axes = [WireAxis(0), WireAxis(1, sign=-1)]
        self.world = AxisWorld(*self.axes)
        specs = [AxisSpec(node_id=0, joint="left"), AxisSpec(node_id=1, joint="right", sign=-1)]
        self.bus = ODriveBus(
            MemoryBus(self.world.wire), self.world, specs, EMULATED_ENDPOINTS, HEARTBEAT_S
        )

    def speeds(self) -> list[float]:
        return [axis.velocity_rad_s for axis in self.axes]

    def powered(self) -> list[bool]:
        return [axis.state is AxisState.CLOSED_LOOP_CONTROL for axis in self.axes]

    def kill(self, row: int) -> None:
        self.axes[row].supplied = False

    def fail(self, row: int) -> None:
        self.axes[row].disarm(AxisError.MOTOR_OVER_TEMP)

    def break_down(self, row: int) -> None:
        self.axes[row].disarm(AxisError.DRV_FAULT)


@pytest.fixture
def cia402() -> Cia402Bench:
    return Cia402Bench()


@pytest.fixture
def odrive() -> ODriveBench:
    return ODriveBench()
