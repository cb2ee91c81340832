"""Serve free-running servos on a pseudo-terminal, for drivers and tools that need no robot.

On a paced bus a reply leaves at the microsecond at which its last bit would have arrived: the loop
sleeps until shortly before and then watches the clock, and shafts are turned while nothing is due.
A paced bus also hears at which speed the host talks; see `WireBank.set_host_baud`.
"""

import select
from collections.abc import Callable, Mapping, Sequence
from itertools import cycle, islice
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S, Clock
from drivers.dynamixel.tables.control_table import MODELS, PULSE_RAD
from drivers.feetech.table import FEETECH_MODELS
from sim_twin.ports.pty_line import PtyLine
from sim_twin.servos.bank import ServoBank
from sim_twin.servos.feetech import EmulatedFeetechSpec, FeetechBank, FeetechOptions
from sim_twin.servos.firmware.coupling import Coupling
from sim_twin.servos.firmware.rail import SupplyVolts
from sim_twin.servos.firmware.rotor import FreeRotors, MotorFigures
from sim_twin.servos.protocol.timing import WireTiming
from sim_twin.servos.robot_bank import robot_bank, supply_volts
from sim_twin.servos.spec import EmulatedServoSpec, FirmwareOptions
from sim_twin.servos.wire_bank import WireBank
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.kinematics.mjcf import read_mjcf_names

STEP_S: Final = 0.002
_STEP_NS: Final = round(STEP_S * NS_PER_S)
_MAX_STEPS_BEHIND: Final = 50
_MAX_STEPS_WAITING: Final = 5
_STEP_COST_NS: Final = 300_000
"""A step does not begin this shortly before a reply is due."""
_ANSWER_NS: Final = 500_000
"""A host that has its reply may send at once; a step would make the bytes seem to come late."""
_WATCH_NS: Final = 150_000
"""Sleep may end this late, so the rest of the time before a reply is spent watching the clock."""


class FreeBank:
    """Turn a bank's shafts on their own, in steps of `STEP_S`, as time goes on."""

    def __init__(
        self, bank: WireBank[Any], models: Sequence[MotorFigures], supply_v: SupplyVolts
    ) -> None:
        self.bank = bank
        self.rotors = FreeRotors(models)
        self.supply_v = supply_v
        self.now_ns = 0

    def advance_to(self, now_ns: int) -> None:
        """Make the steps that are due; after a long pause, skip the time that was missed."""
        if now_ns - self.now_ns > _MAX_STEPS_BEHIND * _STEP_NS:
            self.now_ns = now_ns - _STEP_NS
        while self.now_ns + _STEP_NS <= now_ns:
            self._advance()

    def _advance(self) -> None:
        self.now_ns += _STEP_NS
        rotors = self.rotors
        duty = self.bank.advance(self.now_ns, rotors.motion, rotors.torque_nm, self.supply_v)
        rotors.advance(duty, STEP_S)


class FreeServos(FreeBank):
    """Emulate Dynamixel servos whose shafts turn on their own.

    Without `supply_v` for all of them, each has the voltage that it is made for.
    """

    def __init__(
        self,
        specs: Sequence[EmulatedServoSpec],
        options: FirmwareOptions | None = None,
        supply_v: float | None = None,
        timing: WireTiming | None = None,
    ) -> None:
        models = [MODELS[spec.model_name] for spec in specs]
        volts, feeds = _supplies_for(models, supply_v)
        super().__init__(ServoBank(specs, options, timing, feeds=feeds), models, volts)


class FreeFeetechServos(FreeBank):
    """Emulate FEETECH servos whose shafts turn on their own.

    Without `supply_v` for all of them, each has the voltage that it is made for.
    """

    def __init__(
        self,
        specs: Sequence[EmulatedFeetechSpec],
        options: FeetechOptions | None = None,
        supply_v: float | None = None,
        timing: WireTiming | None = None,
    ) -> None:
        models = [spec.datasheet for spec in specs]
        volts, feeds = _supplies_for(models, supply_v)
        super().__init__(FeetechBank(specs, options, timing, feeds=feeds), models, volts)


class FreeRobotServos(FreeBank):
    """Emulate a robot's servos without the robot: ids, models and supplies are those of its file.

    Shafts begin in the middle of their turn, or at a stop that is before it, and end where the
    MJCF's joints do, as the signs and offsets of the file have it; horns may be mounted
    `horn_off_pulses` of the encoder further, which the file does not know.
    """

    def __init__(
        self,
        robot: RobotDescription,
        timing: WireTiming | None = None,
        horn_off_pulses: float = 0.0,
    ) -> None:
        servos = robot.servo_bus.all_servos
        coupling = Coupling.direct(len(servos))
        models = [MODELS.get(one.model) or FEETECH_MODELS[one.model] for one in servos]
        volts = tuple(supply_volts(robot.servo_bus).values())
        super().__init__(robot_bank(robot.servo_bus, timing, coupling), models, volts)
        ranges = read_mjcf_names(robot.mjcf_path).joint_ranges
        for row, servo in enumerate(servos):
            if (ends := ranges.get(servo.joint)) is not None:
                per_joint = servo.sign * servo.travel_per_rad
                angles = sorted((end - servo.offset) / per_joint for end in ends)
                self.rotors.stops_rad[:, row] = np.array(angles) + horn_off_pulses * PULSE_RAD
        self.rotors.position_rad[:] = np.clip(0.0, *self.rotors.stops_rad)


def _supplies_for(
    models: Sequence[MotorFigures], supply_v: float | None
) -> tuple[tuple[float, ...], list[int]]:
    """Return the voltages of the supplies, and which one feeds each motor."""
    if supply_v is not None:
        return (supply_v,), [0] * len(models)
    volts = sorted({model.voltage_v for model in models})
    return tuple(volts), [volts.index(model.voltage_v) for model in models]


def make_specs(
    count: int, model_names: Sequence[str], eeprom: Mapping[str, int] | None = None
) -> list[EmulatedServoSpec]:
    """Return Dynamixel servos with ids from 1 whose models take turns."""
    names = islice(cycle(model_names), count)
    return [
        EmulatedServoSpec(id=row + 1, model_name=name, eeprom=eeprom or {})
        for row, name in enumerate(names)
    ]


def make_feetech_specs(
    count: int, model_names: Sequence[str], eeprom: Mapping[str, int] | None = None
) -> list[EmulatedFeetechSpec]:
    """Return FEETECH servos with ids from 1 whose models take turns."""
    names = islice(cycle(model_names), count)
    return [
        EmulatedFeetechSpec(id=row + 1, model_name=name, eeprom=eeprom or {})
        for row, name in enumerate(names)
    ]


def serve(servos: FreeBank, link_path: Path, clock: Clock, should_stop: Callable[[], bool]) -> None:
    """Answer on `link_path` until `should_stop()`, asleep between bytes and steps."""
    servos.advance_to(clock.now_ns())
    bank = servos.bank
    if bank.paced:
        line = PtyLine(bank, link_path, now_ns=clock.now_ns, on_baud=bank.set_host_baud)
    else:
        line = PtyLine(bank, link_path)
    try:
        while not should_stop():
            _turn(servos, line, clock)
    finally:
        line.close()


def _turn(servos: FreeBank, line: PtyLine, clock: Clock) -> None:
    """Do what is due, then wait for bytes or for what is due next."""
    now_ns, due_ns = clock.now_ns(), servos.bank.next_due_ns()
    behind = now_ns - servos.now_ns > _MAX_STEPS_WAITING * _STEP_NS
    if servos.bank.paced and due_ns is None and not behind and _readable(line, _ANSWER_NS):
        line.poll_once()
        return
    if due_ns is None or due_ns - now_ns > _STEP_COST_NS or behind:
        servos.advance_to(now_ns)
        step_ns = servos.now_ns + _STEP_NS
        if due_ns is None or due_ns > step_ns + _STEP_COST_NS:
            if _readable(line, step_ns - clock.now_ns()):
                line.poll_once()
            return
    if _readable(line, due_ns - _WATCH_NS - clock.now_ns()):
        line.poll_once()
    else:
        line.send_at(due_ns, clock.now_ns)


def _readable(line: PtyLine, timeout_ns: int) -> bool:
    """Wait for bytes of the host; select alone among its kind takes less than a millisecond."""
    ready, _, _ = select.select([line.fileno()], [], [], max(0.0, timeout_ns / NS_PER_S))
    return bool(ready)
