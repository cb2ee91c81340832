"""Publish /joint_states, /odom, /tf, /tf_static, /robot_description, and the twin's /clock."""

from array import array
from collections.abc import Sequence
from typing import Final

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from vla_deploy.gateways.ros.conversions import fill_pose, quaternion_of
from vla_deploy.gateways.ros.geometry import pose_of
from vla_deploy.gateways.ros.graph import LATCHED, RELIABLE, SENSOR
from vla_deploy.gateways.ros.part import MAP, ODOM, Due, Gateway, GatewayPart
from vla_deploy.ipc import Sample, topics
from vla_deploy.robots.floor_pose import ORIGIN, Pose2D
from vla_deploy.robots.kinematics.frame_tree import BASE_FRAME, FrameTransform, FrameTree
from vla_deploy.robots.kinematics.urdf import urdf_of

_POSE_AGE_S: Final = 0.5
_JOINT_AGE_S: Final = 0.25
# Of wheel odometry, per metre and per radian driven, as REP-105 leaves to the robot: what the pose
# filter reckons with is of the map; this says only that z, roll and pitch are not measured.
_UNMEASURED: Final = 1e6
_COVARIANCE: Final = np.diag([1e-3, 1e-3, _UNMEASURED, _UNMEASURED, _UNMEASURED, 3e-3]).ravel()


class Frames:
    """Publish the body's frames: the fixed ones once, the moving ones with every look.

    Messages are filled in place: to make twenty anew, fifty times a second, costs as much as all
    the rest.
    """

    def __init__(self, gateway: Gateway) -> None:
        graph, robot = gateway.graph, gateway.robot
        self._time = gateway.time
        self._tree = FrameTree.of(robot)
        self._names = robot.joint_names
        self._moving = graph.publisher(TFMessage, "/tf", RELIABLE)
        self._fixed = graph.publisher(TFMessage, "/tf_static", LATCHED)
        self._description = graph.publisher(String, "/robot_description", LATCHED)
        self._description.publish(String(data=urdf_of(robot)))
        stamp = self._time.now()
        self._fixed.publish(TFMessage(transforms=[_of(one, stamp) for one in self._tree.fixed]))
        self._body = [_named(*one[:2]) for one in self._tree.transforms({})]
        self._odom, self._map = _named(ODOM, BASE_FRAME), _named(MAP, ODOM)

    def publish(self, joints: Sample | None, base: Sample | None, pose: Sample | None) -> None:
        """Publish where everything is, in one message."""
        known = []
        if joints is not None:
            values = joints.data["position"][: len(self._names)].tolist()
            found = self._tree.transforms(dict(zip(self._names, values, strict=True)))
            stamp = self._time.stamp(joints.stamp_ns)
            for message, one in zip(self._body, found, strict=True):
                _fill(message, stamp, one.xyz, one.quaternion)
            known += self._body
        if base is not None:
            odom, stamp = pose_of(base), self._time.stamp(base.stamp_ns)
            _stand(self._odom, stamp, odom)
            known.append(self._odom)
            if pose is not None:
                _stand(self._map, stamp, pose_of(pose).compose(ORIGIN.relative_to(odom)))
                known.append(self._map)
        if known:
            self._moving.publish(TFMessage(transforms=known))


class BodyTopics(GatewayPart):
    """Publish joints and odometry at their rates, and with odometry the frames."""

    def __init__(self, gateway: Gateway) -> None:
        graph, settings = gateway.graph, gateway.settings
        self._gateway = gateway
        self._names = list(gateway.robot.joint_names)
        self._stall_nm = np.array(
            [gateway.robot.stall_effort(joint) for joint in gateway.robot.joint_names]
        )
        self._joints = graph.publisher(JointState, "/joint_states", RELIABLE)
        self._odometry = graph.publisher(Odometry, "/odom", SENSOR)
        self._frames = Frames(gateway)
        self._clock = (
            graph.publisher(ClockMessage, "/clock", SENSOR) if gateway.time.is_simulated else None
        )
        self._joints_due = Due(settings.joint_state_rate_hz)
        self._odometry_due = Due(settings.odometry_rate_hz)

    def step(self, now_ns: int) -> None:
        """Publish what is due."""
        if self._clock is not None:
            self._clock.publish(ClockMessage(clock=self._gateway.time.now()))
        link = self._gateway.link
        joints_due = self._joints_due.is_now(now_ns)
        odometry_due = self._odometry_due.is_now(now_ns)
        joints = (
            link.fresh(topics.JOINT_STATE, _JOINT_AGE_S) if joints_due or odometry_due else None
        )
        if joints_due and joints is not None:
            self._publish_joints(joints)
        if odometry_due:
            base = link.fresh(topics.BASE_STATE, _POSE_AGE_S)
            if base is not None:
                self._publish_odometry(base)
            self._frames.publish(joints, base, link.fresh(topics.POSE, _POSE_AGE_S))

    def _publish_joints(self, sample: Sample) -> None:
        count, data = len(self._names), sample.data
        message = JointState()
        message.header.stamp = self._gateway.time.stamp(sample.stamp_ns)
        message.name = self._names
        message.position = array("d", data["position"][:count].tobytes())
        message.velocity = array("d", data["velocity"][:count].tobytes())
        effort = data["effort_ratio"][:count].astype(np.float64) * self._stall_nm
        message.effort = array("d", effort.tobytes())
        self._joints.publish(message)

    def _publish_odometry(self, sample: Sample) -> None:
        data, pose = sample.data, pose_of(sample)
        message = Odometry(child_frame_id=BASE_FRAME)
        message.header.stamp = self._gateway.time.stamp(sample.stamp_ns)
        message.header.frame_id = ODOM
        fill_pose(message.pose.pose, pose)
        message.twist.twist.linear.x = float(data["v_m_s"])
        message.twist.twist.linear.y = float(data["left_m_s"])
        message.twist.twist.angular.z = float(data["w_rad_s"])
        message.pose.covariance = message.twist.covariance = _COVARIANCE
        self._odometry.publish(message)


def _named(parent: str, child: str) -> TransformStamped:
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id = parent
    return message


def _of(frame: FrameTransform, stamp: Time) -> TransformStamped:
    message = _named(frame.parent, frame.child)
    _fill(message, stamp, frame.xyz, frame.quaternion)
    return message


def _fill(
    message: TransformStamped, stamp: Time, xyz: Sequence[float], quaternion: Sequence[float]
) -> None:
    message.header.stamp = stamp
    translation, rotation = message.transform.translation, message.transform.rotation
    translation.x, translation.y, translation.z = xyz
    rotation.x, rotation.y, rotation.z, rotation.w = quaternion


def _stand(message: TransformStamped, stamp: Time, pose: Pose2D) -> None:
    message.header.stamp = stamp
    translation = message.transform.translation
    translation.x, translation.y = pose.x_m, pose.y_m
    message.transform.rotation = quaternion_of(pose.yaw_rad)
