"""Publish what lidar, IMU and camera measure, in the field's own messages."""

from array import array
from typing import Any, Final

import numpy as np
from geometry_msgs.msg import Vector3
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image, Imu, LaserScan

from drivers.camera.protocol import Intrinsics
from vla_deploy.gateways.ros.conversions import quaternion_of
from vla_deploy.gateways.ros.graph import SENSOR
from vla_deploy.gateways.ros.part import Due, Gateway, GatewayPart
from vla_deploy.ipc import Frame, Sample, topics
from vla_deploy.ipc.rgbd_image import colours, depths_mm
from vla_deploy.ipc.topics import SCAN_BEAMS
from vla_deploy.robots.kinematics.frame_tree import BASE_FRAME, LIDAR_FRAME, OPTICAL_FRAME

# Datasheet of the LD19, table 2: 0.02 to 12 m.
_RANGE_M: Final = (0.02, 12.0)
IMU_HZ: Final = 50.0
_PLUMB_BOB: Final = 5
_RATIONAL: Final = 8
_UNKNOWN: Final = -1.0
"""In the first place of a covariance: there is no estimate of this at all (sensor_msgs/Imu)."""


class Scans(GatewayPart):
    """Publish /scan, each measured once."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._scan = gateway.graph.publisher(LaserScan, "/scan", SENSOR)
        self._sequence = 0

    def step(self, now_ns: int) -> None:
        """Publish a scan that is new."""
        sample = self._gateway.link.fresh(topics.SCAN, 0.5)
        if sample is None or sample.sequence == self._sequence:
            return
        self._sequence = sample.sequence
        self._scan.publish(self._message(sample))

    def _message(self, sample: Sample) -> LaserScan:
        ranges = np.array(sample.data["range_m"], dtype=np.float32)
        ranges[ranges == 0.0] = np.inf  # no return: REP-117
        ages_s = np.asarray(sample.data["beam_age_s"], dtype=np.float64)
        message = LaserScan(
            angle_min=0.0,
            angle_max=float(np.deg2rad(SCAN_BEAMS - 1)),
            angle_increment=float(np.deg2rad(1.0)),
            scan_time=float(ages_s.max() - ages_s.min()),
            range_min=_RANGE_M[0],
            range_max=_RANGE_M[1],
        )
        # Beams are sorted by angle, not by time, so no increment is true: the middle moment counts.
        message.header.stamp = self._gateway.time.stamp(
            sample.stamp_ns - round(float(np.median(ages_s)) * 1e9)
        )
        message.header.frame_id = LIDAR_FRAME
        message.ranges = array("f", ranges.tobytes())
        return message


class Inertia(GatewayPart):
    """Publish /imu/data, each measurement once and at most so often."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._imu = gateway.graph.publisher(Imu, "/imu/data", SENSOR)
        self._due = Due(IMU_HZ)
        self._sequence = 0

    def step(self, now_ns: int) -> None:
        """Publish a measurement that is new."""
        if not self._due.is_now(now_ns):
            return
        sample = self._gateway.link.fresh(topics.IMU, 0.2)
        if sample is None or sample.sequence == self._sequence:
            return
        self._sequence = sample.sequence
        data = sample.data
        message = Imu()
        message.header.stamp = self._gateway.time.stamp(sample.stamp_ns)
        message.header.frame_id = BASE_FRAME  # perception turns what the sensor says into it
        message.orientation = quaternion_of(
            float(data["yaw_rad"]), float(data["pitch_rad"]), float(data["roll_rad"])
        )
        message.angular_velocity_covariance[0] = _UNKNOWN
        x, y, z = (float(one) for one in data["acceleration_m_s2"])
        message.linear_acceleration = Vector3(x=x, y=y, z=z)
        self._imu.publish(message)


class Images(GatewayPart):
    """Publish colours, depths and the lens, where somebody listens."""

    def __init__(self, gateway: Gateway) -> None:
        graph = gateway.graph
        self._gateway = gateway
        self._colour = graph.publisher(Image, "/camera/color/image_raw", SENSOR)
        self._depth = graph.publisher(Image, "/camera/depth/image_raw", SENSOR)
        self._lens = [
            graph.publisher(CameraInfo, f"/camera/{kind}/camera_info", SENSOR)
            for kind in ("color", "depth")
        ]
        self._info = _camera_info(gateway.robot.camera.intrinsics)
        self._due = Due(gateway.settings.image_rate_hz)
        self._stamp_ns = 0

    def step(self, now_ns: int) -> None:
        """Publish an image that is new."""
        if not self._due.is_now(now_ns):
            return
        frame = self._gateway.link.frame(topics.RGBD, 1.0)
        if frame is None or frame.stamp_ns == self._stamp_ns:
            return
        self._stamp_ns = frame.stamp_ns
        stamp = self._gateway.time.stamp(frame.stamp_ns)
        self._info.header.stamp = stamp
        for lens in self._lens:
            lens.publish(self._info)
        for publisher, make in ((self._colour, _colour), (self._depth, _depth)):
            if publisher.get_subscription_count() > 0:
                message = make(frame)
                message.header.stamp, message.header.frame_id = stamp, OPTICAL_FRAME
                publisher.publish(message)


def _colour(frame: Frame) -> Image:
    return _image(frame, "rgb8", 3, colours(frame))


def _depth(frame: Frame) -> Image:
    """Return depths in millimetres, as REP-118 has them for OpenNI's cameras."""
    return _image(frame, "16UC1", 2, depths_mm(frame))


def _image(frame: Frame, encoding: str, pixel_bytes: int, pixels: NDArray[Any]) -> Image:
    data = array("B")
    data.frombytes(pixels.data.cast("B"))
    return Image(
        height=frame.height,
        width=frame.width,
        encoding=encoding,
        is_bigendian=0,
        step=frame.width * pixel_bytes,
        data=data,
    )


def _camera_info(lens: Intrinsics) -> CameraInfo:
    """Return the camera's lens as sensor_msgs has it; without a calibration it is a pinhole."""
    rows = [[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]]
    several = len(lens.distortion) > _PLUMB_BOB
    count = _RATIONAL if several else _PLUMB_BOB
    message = CameraInfo(
        width=lens.width,
        height=lens.height,
        distortion_model="rational_polynomial" if several else "plumb_bob",
        d=[*map(float, lens.distortion), *([0.0] * (count - len(lens.distortion)))],
    )
    message.header.frame_id = OPTICAL_FRAME
    message.k = np.array(rows).ravel()
    message.r = np.eye(3).ravel()
    message.p = np.hstack([rows, np.zeros((3, 1))]).ravel()
    return message
