from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pytest

from drivers.clock import NS_PER_S
from drivers.feetech.codec import (
    FEETECH_BROADCAST_ID,
    FeetechInstruction,
    FeetechPacket,
    FeetechParser,
    encode_packet,
)
from drivers.feetech.table import FEETECH_MODELS
from sim_twin.servos.feetech import EmulatedFeetechSpec, FeetechBank, FeetechOptions
from sim_twin.servos.firmware.rotor import FreeRotors

STEP_NS = 2_000_000


class FeetechBench:
    """Servos on a bench: their shafts turn freely, the host talks packets, time is stepped."""

    def __init__(
        self,
        models: Sequence[str] = ("STS3215-C018",),
        *,
        eeprom: Mapping[str, int] | None = None,
        options: FeetechOptions | None = None,
    ) -> None:
        self.models = [FEETECH_MODELS[name] for name in models]
        self.bank = FeetechBank(
            [
                EmulatedFeetechSpec(id=row + 1, model_name=name, eeprom=eeprom or {})
                for row, name in enumerate(models)
            ],
            options,
        )
        self.rotors = FreeRotors(self.models)
        self.now_ns = NS_PER_S
        self.supply_v = self.models[0].voltage_v
        self.blocked = False
        self.duty = np.zeros(len(models))
        self.run(0.004)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * NS_PER_S / STEP_NS)):
            self._step()

    def _step(self) -> None:
        self.now_ns += STEP_NS
        rotors = self.rotors
        self.duty = self.bank.advance(self.now_ns, rotors.motion, rotors.torque_nm, self.supply_v)
        if self.blocked:
            rotors.velocity_rad_s[:] = 0.0
            rotors.torque_nm = np.array([m.stall_torque_nm for m in self.models]) * self.duty
        else:
            rotors.advance(self.duty, STEP_NS / NS_PER_S)

    def turn_to(self, steps: float) -> None:
        """Set the angle of all shafts, in steps as a new servo shows it."""
        for row, model in enumerate(self.models):
            self.rotors.position_rad[row] = (steps - model.centre_step) * model.step_rad
        self.rotors.velocity_rad_s[:] = 0.0
        self._step()

    def send(self, servo_id: int, instruction: int, params: bytes = b"") -> list[FeetechPacket]:
        self.bank.receive(encode_packet(servo_id, instruction, params))
        parser = FeetechParser()
        packets = parser.feed(self.bank.transmit())
        assert (parser.pending_bytes, parser.check_errors, parser.discarded_bytes) == (0, 0, 0)
        return packets

    def write(self, name: str, value: int, servo_id: int = 1) -> int:
        """Return the error byte of the answer to a write."""
        register = self.models[servo_id - 1].registers[name]
        params = bytes([register.address]) + register.to_bytes(value)
        (reply,) = self.send(servo_id, FeetechInstruction.WRITE, params)
        return reply.code

    def read(self, name: str, servo_id: int = 1) -> int:
        register = self.models[servo_id - 1].registers[name]
        params = bytes([register.address, register.size])
        (reply,) = self.send(servo_id, FeetechInstruction.READ, params)
        return register.from_bytes(reply.params)

    def error(self, servo_id: int = 1) -> int:
        (reply,) = self.send(servo_id, FeetechInstruction.PING)
        return reply.code

    def sync_read(self, address: int, count: int, ids: Sequence[int]) -> list[FeetechPacket]:
        params = bytes([address, count, *ids])
        return self.send(FEETECH_BROADCAST_ID, FeetechInstruction.SYNC_READ, params)

    def reboot(self, servo_id: int = 1) -> None:
        assert self.send(servo_id, FeetechInstruction.REBOOT) == []
        self.run(0.9)


@pytest.fixture
def make_bench() -> Callable[..., FeetechBench]:
    return FeetechBench


@pytest.fixture
def bench() -> FeetechBench:
    return FeetechBench()
