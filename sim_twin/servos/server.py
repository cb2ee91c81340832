"""Serve free-running servos on a pseudo-terminal, for drivers and tools that need no robot."""

import select
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import cycle, islice
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock
from drivers.dynamixel.control_table import MODELS
from sim_twin.pty_line import PtyLine
from sim_twin.servos.bank import ServoBank
from sim_twin.servos.rotor import FreeRotors
from sim_twin.servos.spec import EmulatedServoSpec, FirmwareOptions

STEP_S: Final = 0.002
_STEP_NS: Final = round(STEP_S * NS_PER_S)
_MAX_STEPS_BEHIND: Final = 50


@dataclass(slots=True)
class FreeServos:
    """Turn a bank's shafts on their own, in steps of `STEP_S`, as time goes on."""

    specs: Sequence[EmulatedServoSpec]
    options: FirmwareOptions = field(default_factory=FirmwareOptions)
    supply_v: float = 12.0
    bank: ServoBank = field(init=False)
    rotors: FreeRotors = field(init=False)
    now_ns: int = 0

    def __post_init__(self) -> None:
        self.bank = ServoBank(self.specs, self.options)
        self.rotors = FreeRotors([MODELS[spec.model_name] for spec in self.specs])

    def advance_to(self, now_ns: int) -> None:
        """Make the steps that are due; after a long pause, skip the time that was missed."""
        if now_ns - self.now_ns > _MAX_STEPS_BEHIND * _STEP_NS:
            self.now_ns = now_ns - _STEP_NS
        while self.now_ns + _STEP_NS <= now_ns:
            self._advance()

    def _advance(self) -> None:
        self.now_ns += _STEP_NS
        rotors = self.rotors
        duty = self.bank.advance(
            self.now_ns,
            rotors.position_rad,
            rotors.velocity_rad_s,
            rotors.torque_nm,
            self.supply_v,
        )
        rotors.advance(duty, STEP_S)


def make_specs(count: int, model_names: Sequence[str]) -> list[EmulatedServoSpec]:
    """Return servos with ids from 1 whose models take turns."""
    names = islice(cycle(model_names), count)
    return [EmulatedServoSpec(id=row + 1, model_name=name) for row, name in enumerate(names)]


def serve(
    servos: FreeServos, link_path: Path, clock: Clock, should_stop: Callable[[], bool]
) -> None:
    """Answer on `link_path` until `should_stop()`, asleep between bytes and steps."""
    servos.advance_to(clock.now_ns())
    line = PtyLine(servos.bank, link_path)
    poller = select.poll()
    poller.register(line.fileno(), select.POLLIN)
    try:
        while not should_stop():
            servos.advance_to(clock.now_ns())
            remaining_ns = servos.now_ns + _STEP_NS - clock.now_ns()
            if poller.poll(max(0.0, remaining_ns / 1e6)):
                line.poll_once()
    finally:
        line.close()
