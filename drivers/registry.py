"""List the sensor models there are: (kind, model) -> driver class and line speed.

A driver loads when it is asked for, so that a process pays only for what its robot carries.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from types import MappingProxyType
from typing import Any, Final, cast

from drivers.base import ByteTransport
from drivers.camera.base import Camera, RgbdFrame
from drivers.camera.protocol import Intrinsics
from drivers.clock import Clock
from drivers.errors import UnknownModel
from drivers.imu.base import Imu
from drivers.lidar.base import Lidar


class SensorKind(Enum):
    """Name the kinds of sensor that a robot file may declare by model."""

    LIDAR = "lidar"
    IMU = "imu"
    CAMERA = "camera"


@dataclass(frozen=True, slots=True)
class SensorModel:
    """Say which class drives a model ("module:Class"); `baud` is 0 where no serial line is used.

    `has_depth` is of cameras: whether their images come with depth.
    """

    driver: str
    baud: int = 0
    has_depth: bool = True


RGBD_STREAM: Final = "RGBD-STREAM"
MODELS: Final[Mapping[tuple[SensorKind, str], SensorModel]] = MappingProxyType(
    {
        (SensorKind.LIDAR, "LD19"): SensorModel("drivers.lidar.ld19:Ld19", 230_400),
        (SensorKind.IMU, "BNO085-RVC"): SensorModel("drivers.imu.bno085_rvc:Bno085Rvc", 115_200),
        (SensorKind.CAMERA, RGBD_STREAM): SensorModel("drivers.camera.rgbd_stream:RgbdCamera"),
        (SensorKind.CAMERA, "V4L2"): SensorModel(
            "drivers.camera.colour_only:ColourOnlyCamera", has_depth=False
        ),
    }
)


def model_names(kind: SensorKind) -> tuple[str, ...]:
    """Return the models of a kind that have a driver."""
    return tuple(name for known, name in MODELS if known is kind)


def sensor_model(kind: SensorKind, model: str) -> SensorModel:
    """Return a model's row.

    Raises:
        UnknownModel: no driver knows the model; the message lists those there are.
    """
    row = MODELS.get((kind, model))
    if row is None:
        known = ", ".join(model_names(kind))
        raise UnknownModel(
            f"no driver for the {kind.value} {model!r}; there are drivers for {known}"
        )
    return row


def open_lidar(
    model: str, line: ByteTransport, clock: Clock, *, mounting_yaw_rad: float = 0.0
) -> Lidar:
    """Return the driver of a lidar on its line; `mounting_yaw_rad` is where sensor zero points.

    Raises:
        UnknownModel: no driver knows the model.
    """
    driver = _driver(SensorKind.LIDAR, model)
    return cast("Lidar", driver(line, clock, mounting_yaw_rad=mounting_yaw_rad))


def open_imu(model: str, line: ByteTransport, clock: Clock) -> Imu:
    """Return the driver of an inertial sensor on its line.

    Raises:
        UnknownModel: no driver knows the model.
    """
    return cast("Imu", _driver(SensorKind.IMU, model)(line, clock))


def open_camera(
    model: str,
    source: ByteTransport | str,
    clock: Clock,
    *,
    rate_hz: float,
    pinhole: Intrinsics | None = None,
) -> Camera[RgbdFrame]:
    """Return the driver of a camera; the depth of one that measures none is 0 everywhere.

    `source` is a stream of `drivers/camera/protocol.py`, which then sends at `rate_hz`, or the path
    of a video device, which sends at its own rate and has the lens `pinhole`.

    Raises:
        UnknownModel: no driver knows the model.
        ValueError: the camera cannot have that rate, or the lens of a video device is not given.
        LinkLost: the stream has gone.
    """
    sensor_model(SensorKind.CAMERA, model)
    if isinstance(source, str):
        if pinhole is None:
            raise ValueError(f"camera {source}: expected a lens (`pinhole`), got None; give one")
        return cast("Camera[RgbdFrame]", _driver(SensorKind.CAMERA, model)(source, clock, pinhole))
    # A stream in the place of a video device speaks the one protocol that streams have.
    camera = _driver(SensorKind.CAMERA, RGBD_STREAM)(source, clock)
    camera.start(rate_hz)
    return cast("Camera[RgbdFrame]", camera)


def _driver(kind: SensorKind, model: str) -> Any:
    module, name = sensor_model(kind, model).driver.split(":")
    return getattr(import_module(module), name)
