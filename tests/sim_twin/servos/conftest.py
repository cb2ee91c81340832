import struct
from collections.abc import Callable, Mapping, Sequence

import dynamixel_sdk.port_handler
import numpy as np
import pytest

from drivers.clock import NS_PER_S
from drivers.dynamixel.tables.control_table import MODELS, OperatingMode
from drivers.dynamixel.wire.codec import (
    BROADCAST_ID,
    Instruction,
    Packet,
    PacketParser,
    encode_instruction,
)
from sim_twin.servos import EmulatedServoSpec, FirmwareOptions, ServoBank
from sim_twin.servos.firmware.rotor import FreeRotors

STEP_NS = 2_000_000


class Bench:
    """Servos on a bench: their shafts turn freely, the host talks packets, time is stepped."""

    def __init__(
        self,
        models: Sequence[str] = ("XM430-W350",),
        *,
        eeprom: Mapping[str, int] | None = None,
        options: FirmwareOptions | None = None,
        inertia_kg_m2: float = 0.01,
    ) -> None:
        specs = [
            EmulatedServoSpec(id=row + 1, model_name=name, eeprom=eeprom or {})
            for row, name in enumerate(models)
        ]
        self.models = [MODELS[name] for name in models]
        self.bank = ServoBank(specs, options)
        self.rotors = FreeRotors(self.models, inertia_kg_m2)
        self.now_ns = NS_PER_S
        self.supply_v = self.models[0].voltage_v
        self.blocked = False
        self.duty = np.zeros(len(models))
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

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * NS_PER_S / STEP_NS)):
            self._step()

    def turn_to(self, position_rad: float) -> None:
        """Set the angle of all shafts, and step once so that the encoders sense it."""
        self.rotors.position_rad[:] = position_rad
        self.rotors.velocity_rad_s[:] = 0.0
        self._step()

    def arm(self, mode: OperatingMode = OperatingMode.POSITION) -> None:
        """Choose a mode and switch torque on."""
        assert self.write("operating_mode", mode) == 0
        assert self.write("torque_enable", 1) == 0

    def samples(self, name: str, seconds: float, period_s: float = 0.01) -> list[int]:
        """Read a register again and again."""
        values = []
        for _ in range(round(seconds / period_s)):
            self.run(period_s)
            values.append(self.read(name))
        return values

    def send(self, servo_id: int, instruction: int, params: bytes = b"") -> list[Packet]:
        self.bank.receive(encode_instruction(servo_id, instruction, params))
        parser = PacketParser()
        parser.feed(self.bank.transmit())
        packets = parser.packets()
        assert parser.crc_errors == 0
        assert parser.pending_bytes == 0
        return packets

    def write_bytes(self, servo_id: int, address: int, data: bytes) -> int:
        """Return the status error of a write."""
        reply = self.send(servo_id, Instruction.WRITE, struct.pack("<H", address) + data)
        assert len(reply) == 1
        assert reply[0].error is not None
        return reply[0].error

    def write(self, name: str, value: int, servo_id: int = 1) -> int:
        register = self.models[servo_id - 1].registers[name]
        return self.write_bytes(servo_id, register.address, register.to_bytes(value))

    def read(self, name: str, servo_id: int = 1) -> int:
        register = self.models[servo_id - 1].registers[name]
        params = struct.pack("<HH", register.address, register.size)
        reply = self.send(servo_id, Instruction.READ, params)
        assert len(reply) == 1
        return register.from_bytes(reply[0].params)

    def sync_read(self, address: int, length: int, ids: Sequence[int]) -> list[Packet]:
        params = struct.pack("<HH", address, length) + bytes(ids)
        return self.send(BROADCAST_ID, Instruction.SYNC_READ, params)

    def sync_write(self, address: int, length: int, data: Mapping[int, bytes]) -> None:
        params = struct.pack("<HH", address, length)
        params += b"".join(bytes([servo_id]) + value for servo_id, value in data.items())
        assert self.send(BROADCAST_ID, Instruction.SYNC_WRITE, params) == []


@pytest.fixture
def make_bench() -> Callable[..., Bench]:
    return Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture(autouse=True)
def patient_host(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the vendor's library wait as for a slow adapter: it goes by the wall clock."""
    monkeypatch.setattr(dynamixel_sdk.port_handler, "LATENCY_TIMER", 1500)
