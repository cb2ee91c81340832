"""Compute a robot's kinematics and its own weight from the MJCF, with pinocchio.

Poses are 4x4 matrices in the base frame; positions are arrays in the robot file's joint order.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pinocchio
from numpy.typing import NDArray

from vla_deploy.robots.camera import CameraDescription
from vla_deploy.robots.description import RobotDescription
from vla_deploy.robots.errors import PartMissing, RobotFileError
from vla_deploy.robots.kinematics.mjcf import read_mjcf_names
from vla_deploy.runtime.table_schema import TableFault

Array = NDArray[np.float64]


class RobotModel:
    """Answer where the sites are and what holds the joints up; one instance per thread."""

    def __init__(self, robot: RobotDescription) -> None:
        """Build the model with base and wheels locked, followers coupled to their leaders.

        Raises:
            RobotFileError: pinocchio does not find the robot file's joints in the MJCF.
        """
        self._path = str(robot.mjcf_path)
        whole = pinocchio.buildModelFromMJCF(self._path)
        self._check_joints(robot, whole)
        mimics = read_mjcf_names(robot.mjcf_path).mimics
        moving = {*robot.joint_names, *mimics}
        locked = [i for i in range(1, whole.njoints) if whole.names[i] not in moving]
        self._model = pinocchio.buildReducedModel(whole, locked, pinocchio.neutral(whole))
        self._data = self._model.createData()
        self._frames: dict[str, int] = {}
        self.joint_names = robot.joint_names
        self.total_mass_kg = float(pinocchio.computeTotalMass(whole))
        self._camera = robot.parts.camera
        self._coupling = self._couple(mimics)

    def gravity(self, positions: Array) -> Array:
        """Return the torque (N m; N for a finger) that holds each joint against gravity."""
        q = self._coupling @ positions
        torque = pinocchio.computeGeneralizedGravity(self._model, self._data, q)
        return np.asarray(self._coupling.T @ torque, dtype=np.float64)

    def inverse_dynamics(self, positions: Array, velocities: Array, accelerations: Array) -> Array:
        """Return the torque (N m; N for a finger) that this motion takes, gravity included."""
        coupling = self._coupling
        torque = pinocchio.rnea(
            self._model,
            self._data,
            coupling @ positions,
            coupling @ velocities,
            coupling @ accelerations,
        )
        return np.asarray(coupling.T @ torque, dtype=np.float64)

    def site_pose(self, site: str, positions: Array) -> Array:
        """Return a site's pose in the base frame.

        Raises:
            KeyError: the MJCF has no such site.
        """
        frame = self._frame(site)
        q = self._coupling @ positions
        pinocchio.framesForwardKinematics(self._model, self._data, q)
        return np.array(self._data.oMf[frame].homogeneous, dtype=np.float64)

    def joint_poses(self, positions: Array) -> dict[str, Array]:
        """Return the pose of every joint's frame in the base frame, followers included."""
        q = self._coupling @ positions
        pinocchio.forwardKinematics(self._model, self._data, q)
        return {
            self._model.names[joint]: np.array(self._data.oMi[joint].homogeneous, dtype=np.float64)
            for joint in range(1, self._model.njoints)
        }

    def site_jacobian(self, site: str, positions: Array) -> Array:
        """Return the site's velocity per joint velocity, 6 x joints: linear first, site's frame.

        Raises:
            KeyError: the MJCF has no such site.
        """
        frame = self._frame(site)
        q = self._coupling @ positions
        local = pinocchio.computeFrameJacobian(
            self._model, self._data, q, frame, pinocchio.ReferenceFrame.LOCAL
        )
        return np.asarray(local @ self._coupling, dtype=np.float64)

    def camera_pose(self, positions: Array) -> Array:
        """Return the camera's optical frame (x right, y down, z forward) in the base frame.

        It is where the calibration of its mounting puts it, else its site.

        Raises:
            PartMissing: the robot has none.
        """
        camera = self._fitted_camera()
        pose: Array = self.site_pose(camera.site, positions) @ camera.site_from_camera
        return pose

    @property
    def camera_joint(self) -> str:
        """Return the joint that carries the camera.

        Raises:
            PartMissing: the robot has none.
        """
        frame = self._model.frames[self._frame(self._fitted_camera().site)]
        return str(self._model.names[frame.parentJoint])

    def shapes(
        self, kind: pinocchio.GeometryType
    ) -> Iterator[tuple[str | None, pinocchio.GeometryObject]]:
        """Yield the MJCF's shapes of a kind, each with the joint in whose frame it is placed.

        The joint is None for those of the base.
        """
        for shape in pinocchio.buildGeomFromMJCF(self._model, self._path, kind).geometryObjects:
            joint = shape.parentJoint
            yield (str(self._model.names[joint]) if joint else None), shape

    def _fitted_camera(self) -> CameraDescription:
        if self._camera is None:
            raise PartMissing("the robot has no camera: [camera] is not in its file")
        return self._camera

    def _frame(self, site: str) -> int:
        frame = self._frames.get(site)
        if frame is None:
            if not self._model.existFrame(site):
                raise KeyError(f"the MJCF has no site {site!r}")
            frame = self._frames[site] = int(self._model.getFrameId(site))
        return frame

    def _couple(self, mimics: Mapping[str, str]) -> Array:
        """Return the matrix that turns joint positions into pinocchio's, followers included."""
        index = {name: i for i, name in enumerate(self.joint_names)}
        coupling: Array = np.zeros((self._model.nq, len(self.joint_names)))
        for joint in range(1, self._model.njoints):
            name = self._model.names[joint]
            coupling[self._model.idx_qs[joint], index[mimics.get(name, name)]] = 1.0
        return coupling

    @staticmethod
    def _check_joints(robot: RobotDescription, whole: pinocchio.Model) -> None:
        # Pinocchio returns an empty model, silently, for a file whose first body is not the robot.
        missing = [name for name in robot.joint_names if not whole.existJointName(name)]
        if missing:
            got = f"a model of {whole.nq} coordinates without {', '.join(missing)}"
            fault = TableFault(
                key="mjcf", got=got, expected="every servo joint below the first body"
            )
            raise RobotFileError(robot.mjcf_path, (fault,))


def full_positions(robot: RobotDescription, named: Sequence[tuple[str, float]] = ()) -> Array:
    """Return a joint array: each named joint at its value, the others at the nearest to zero."""
    positions: Array = np.clip(0.0, robot.position_min, robot.position_max)
    index = robot.joint_index
    for name, value in named:
        positions[index[name]] = value
    return positions
