"""Emulate the BNO085 in UART-RVC mode: one 19-byte frame every 10 ms."""

import math
import struct
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from drivers.clock import NS_PER_S
from drivers.imu.bno085_rvc import HEADER, STANDARD_GRAVITY_M_S2

ANGLE_SIGMA_RAD = math.radians(0.02)
ACCELERATION_SIGMA_M_S2 = 0.03
YAW_DRIFT_RAD_S = math.radians(0.5) / 60.0
_BODY = struct.Struct("<B6h3x")
_CENTIDEGREES_PER_RAD = math.degrees(1.0) * 100.0
_MILLI_G_PER_M_S2 = 1000.0 / STANDARD_GRAVITY_M_S2
_HALF_TURN = 18_000
_NOISY_FRAMES = 64


class ImuTruth(NamedTuple):
    """Hold what the world does to the sensor: attitude, and specific force in its own frame."""

    yaw_rad: float
    pitch_rad: float
    roll_rad: float
    acceleration_m_s2: tuple[float, float, float]


class ImuDevice:
    """Turn the true motion into the BNO085's frames.

    Yaw starts at 0 as on the real sensor and drifts at a rate drawn from the seed, at most
    half a degree a minute; `runaway_rad_s` makes that worse. `rate_hz` may be changed at any time.
    """

    def __init__(
        self, read: Callable[[], ImuTruth], rate_hz: float = 100.0, *, seed: int = 0
    ) -> None:
        self._read = read
        self.rate_hz = rate_hz
        self.runaway_rad_s = 0.0
        self._random = np.random.default_rng(seed)
        self._drift_rad_s = float(self._random.uniform(-YAW_DRIFT_RAD_S, YAW_DRIFT_RAD_S))
        self._noise: list[list[float]] = []
        self._started = False
        self.due_ns = 0
        self._start_yaw_rad = 0.0
        self._drift_rad = 0.0
        self._drifted_ns = 0
        self._index = 0
        self._out = bytearray()

    def receive(self, data: bytes) -> None:
        """Ignore what the host sends: in RVC mode the sensor only talks."""

    def transmit(self) -> bytes:
        """Return and forget the frames that are ready."""
        data = bytes(self._out)
        self._out.clear()
        return data

    def step(self, now_ns: int) -> None:
        """Send a frame when one is due, which is at `due_ns`."""
        if not self._started:
            self._started = True
            self.due_ns = self._drifted_ns = now_ns
            self._start_yaw_rad = self._read().yaw_rad
        if now_ns < self.due_ns:
            return
        self.due_ns = max(self.due_ns + round(NS_PER_S / self.rate_hz), now_ns)
        self._drift(now_ns)
        self._out += self._frame(self._read())
        self._index = (self._index + 1) % 256

    def _drift(self, now_ns: int) -> None:
        elapsed_s = (now_ns - self._drifted_ns) / NS_PER_S
        self._drift_rad += (self._drift_rad_s + self.runaway_rad_s) * elapsed_s
        self._drifted_ns = now_ns

    def _frame(self, truth: ImuTruth) -> bytes:
        yaw, pitch, roll, ahead, left, up = self._next_noise()
        x_m_s2, y_m_s2, z_m_s2 = truth.acceleration_m_s2
        body = _BODY.pack(
            self._index,
            _centidegrees(truth.yaw_rad - self._start_yaw_rad + self._drift_rad, yaw),
            _centidegrees(truth.pitch_rad, pitch),
            _centidegrees(truth.roll_rad, roll),
            _milli_g(x_m_s2, ahead),
            _milli_g(y_m_s2, left),
            _milli_g(z_m_s2, up),
        )
        return HEADER + body + bytes((sum(body) & 0xFF,))

    def _next_noise(self) -> list[float]:
        """Return one standard normal number for each value of a frame."""
        if not self._noise:
            self._noise = self._random.standard_normal((_NOISY_FRAMES, 6)).tolist()
            self._noise.reverse()
        return self._noise.pop()


def _centidegrees(angle_rad: float, noise: float) -> int:
    turned = round((angle_rad + ANGLE_SIGMA_RAD * noise) * _CENTIDEGREES_PER_RAD)
    return (turned + _HALF_TURN) % (2 * _HALF_TURN) - _HALF_TURN


def _milli_g(acceleration_m_s2: float, noise: float) -> int:
    told = round((acceleration_m_s2 + ACCELERATION_SIGMA_M_S2 * noise) * _MILLI_G_PER_M_S2)
    return min(max(told, -32_768), 32_767)
