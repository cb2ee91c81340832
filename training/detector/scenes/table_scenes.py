"""Draw tables with a few things on them as the robot's camera sees them, and know the truth.

The things are those that the detector's training builds, in random sizes and looks; the robot
stands at the origin and looks at them from 0.4 to 1.2 m. Depth has the noise of the twin's camera.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from drivers.camera.protocol import Intrinsics
from sim_twin.pictures.renderer import Renderer, fixed_camera
from sim_twin.sensors.camera import DEPTH_SIGMA_PER_M, DEPTH_UNIT_M
from training.detector.scenes.dress import dress
from training.detector.scenes.layout import ImageContents
from training.detector.scenes.parts import (
    ON_EDGE,
    ON_SIDE,
    UPRIGHT,
    Random,
    RestPose,
    about_z,
    product,
)
from training.detector.scenes.pose import CAMERA
from training.detector.scenes.scene_model import ROBOT_PREFIX, Prop, SceneStage, build_studio
from training.detector.scenes.surfaces import CameraViewpoint, SceneSurface
from vla_deploy.robots import load_robot
from vla_deploy.robots.kinematics.model import RobotModel

Array = NDArray[np.float64]

SCENES_PER_STAGE: Final = 8
THINGS: Final = 4
GAP_M: Final = 0.03
BORDER_PX: Final = 14
RANGE_M: Final = (0.4, 1.2)
TABLE_X_M: Final = (0.25, 0.6)
TABLE_HEIGHT_M: Final = (0.4, 0.75)
_TRIES: Final = 60
ROUND: Final = frozenset({"cup", "ball", "bottle", "can", "bowl"})
SHOWN: Final = {
    "cup": (UPRIGHT,),
    "ball": (UPRIGHT,),
    "bottle": (UPRIGHT, ON_SIDE),
    "can": (UPRIGHT, ON_SIDE),
    "bowl": (UPRIGHT,),
    "box": (UPRIGHT,),
    "book": (UPRIGHT, ON_EDGE),
    "phone": (UPRIGHT,),
    "keys": (UPRIGHT,),
    "remote": (UPRIGHT,),
}
"""How each class is laid; a thing leant against nothing is not judged."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """Hold one thing as it is, in the base frame; `size_m` is length along yaw, width, height.

    A thing that stands is judged by its place alone, any other by its yaw, too.
    """

    class_name: str
    stands: bool
    position_m: tuple[float, float, float]
    size_m: tuple[float, float, float]
    yaw_rad: float
    range_m: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TableScene:
    """Hold one image with the camera's pose in the base frame, and what it shows."""

    rgb: NDArray[np.uint8]
    depth_m: NDArray[np.float32]
    camera: Intrinsics
    base_from_camera: Array
    truths: tuple[Truth, ...]


def draw_scenes(count: int, seed: int) -> Iterator[TableScene]:
    """Yield that many scenes; the same seed gives the same ones.

    Raises:
        OpenGLMissing: nothing can be rendered on this machine.
    """
    drawn = 0
    while drawn < count:
        random = np.random.default_rng([seed, drawn])
        studio = _Studio(random)
        for _ in range(min(SCENES_PER_STAGE, count - drawn)):
            yield studio.scene()
            drawn += 1
        studio.close()


class _Studio:
    """Own one compiled stage and its renderer."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._stage = build_studio(random, "heldout")
        self._robot = load_robot("butler")
        self._kinematics = RobotModel(self._robot)
        camera = self._robot.camera
        self._renderer = Renderer(self._stage.model, camera.width, camera.height)
        self._camera = camera.pinhole

    def scene(self) -> TableScene:
        stage, random = self._stage, self._random
        stage.restore()
        table = self._table()
        pose = self._look_at(table)
        props = self._things(table, pose)
        view = CameraViewpoint(x_m=0.0, y_m=0.0, yaw_rad=0.0, target=(table.x_m, table.y_m, 0.0))
        dress(
            stage, ImageContents(view=view, surfaces=(), shown=[prop for prop, _ in props]), random
        )
        mujoco.mj_kinematics(stage.model, stage.data)
        mujoco.mj_comPos(stage.model, stage.data)
        mujoco.mj_camlight(stage.model, stage.data)
        rgb, depth_m = self._renderer.render(stage.data, fixed_camera(stage.model, CAMERA))
        return TableScene(
            rgb=rgb,
            depth_m=with_noise(depth_m, random),
            camera=self._camera,
            base_from_camera=pose,
            truths=tuple(_truth(stage, prop, rest, pose) for prop, rest in props),
        )

    def close(self) -> None:
        self._renderer.close()

    def _table(self) -> SceneSurface:
        random, table = self._random, self._stage.tables[0]
        half_x, half_y = table.thing.extra["half_depth_m"], table.thing.extra["half_width_m"]
        surface = SceneSurface(
            x_m=float(random.uniform(*TABLE_X_M)) + half_x,
            y_m=float(random.uniform(-0.2, 0.2)),
            yaw_rad=float(random.uniform(-0.25, 0.25)),
            half_x_m=half_x,
            half_y_m=half_y,
            height_m=float(random.uniform(*TABLE_HEIGHT_M)),
        )
        self._stage.show(
            table, (surface.x_m, surface.y_m, surface.height_m), about_z(surface.yaw_rad)
        )
        return surface

    def _look_at(self, table: SceneSurface) -> Array:
        """Turn the head towards the table's nearer half; return the camera's pose."""
        random, limits = self._random, self._robot.limits
        x, y = table.point(random, 0.1)
        eye = self._pose({})[:3, 3]
        down = math.atan2(eye[2] - table.height_m, math.hypot(x - eye[0], y - eye[1]))
        wanted = {"head_pan": math.atan2(y, x), "head_tilt": down + float(random.normal(0, 0.05))}
        head = {
            name: min(limits[name].max, max(limits[name].min, value))
            for name, value in wanted.items()
        }
        arms = {**self._robot.poses["tuck"], **head}
        for name, value in arms.items():
            joint = self._stage.model.joint(f"{ROBOT_PREFIX}{name}").id
            self._stage.data.qpos[self._stage.model.jnt_qposadr[joint]] = value
        return self._pose(arms)

    def _pose(self, joints: dict[str, float]) -> Array:
        positions = np.array([joints.get(name, 0.0) for name in self._robot.joint_names])
        return self._kinematics.camera_pose(positions)

    def _things(self, table: SceneSurface, pose: Array) -> list[tuple[Prop, RestPose]]:
        random, stage = self._random, self._stage
        pool = [prop for prop in stage.props if prop.thing.class_name in SHOWN]
        placed: list[tuple[Prop, RestPose]] = []
        taken: list[tuple[float, float, float]] = []
        for index in random.permutation(len(pool)):
            prop = pool[int(index)]
            rest = self._rest(prop)
            reach = _reach(stage, prop)
            at = self._free_place(table, pose, reach, taken)
            if at is None:
                continue
            taken.append((*at, reach))
            turn = product(about_z(float(random.uniform(-math.pi, math.pi))), rest.quat)
            stage.show(prop, (*at, table.height_m + rest.height_m), turn)
            placed.append((prop, rest))
            if len(placed) == THINGS:
                break
        return placed

    def _rest(self, prop: Prop) -> RestPose:
        rests = [r for r in prop.thing.rests if r.quat in SHOWN[prop.thing.class_name]]
        return rests[int(self._random.integers(len(rests)))]

    def _free_place(
        self,
        table: SceneSurface,
        pose: Array,
        reach: float,
        taken: list[tuple[float, float, float]],
    ) -> tuple[float, float] | None:
        """Return a place on the table, in range and in view, that nothing else takes."""
        for _ in range(_TRIES):
            x, y = table.point(self._random, min(reach, table.half_x_m, table.half_y_m))
            apart = all(math.hypot(x - u, y - v) > reach + other + GAP_M for u, v, other in taken)
            if apart and self._in_view((x, y, table.height_m), pose, reach):
                return x, y
        return None

    def _in_view(self, point: tuple[float, float, float], pose: Array, reach: float) -> bool:
        camera = self._camera
        right, below, ahead = pose[:3, :3].T @ (np.array(point) - pose[:3, 3])
        far = float(np.linalg.norm(np.array(point) - pose[:3, 3]))
        if not RANGE_M[0] + reach < far < RANGE_M[1]:
            return False
        border = BORDER_PX + camera.fx * reach / ahead
        u, v = camera.fx * right / ahead + camera.cx, camera.fy * below / ahead + camera.cy
        high = border + 0.1 * camera.fy / ahead
        return bool(border < u < camera.width - border and high < v < camera.height - border)


def with_noise(depth_m: NDArray[np.float32], random: Random) -> NDArray[np.float32]:
    """Return depth as the twin's camera tells it: with its noise, in whole units."""
    noisy = depth_m + DEPTH_SIGMA_PER_M * depth_m**2 * random.standard_normal(depth_m.shape)
    return (np.rint(noisy / DEPTH_UNIT_M) * DEPTH_UNIT_M).astype(np.float32)


def _reach(stage: SceneStage, prop: Prop) -> float:
    """Return the radius of the ball around the thing's origin that holds it."""
    points = _points(stage.model, prop, np.zeros(3), np.eye(3))
    return float(np.linalg.norm(points, axis=1).max())


def _truth(stage: SceneStage, prop: Prop, rest: RestPose, pose: Array) -> Truth:
    body_at = stage.data.mocap_pos[prop.mocap]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, stage.data.mocap_quat[prop.mocap])
    points = _points(stage.model, prop, body_at, turn.reshape(3, 3))
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    (x, y), (first, second), angle_deg = cv2.minAreaRect((points[:, :2] * 1000).astype(np.float32))
    length, width, yaw = (first, second, angle_deg)
    if first < second:
        length, width, yaw = second, first, angle_deg + 90.0
    name = prop.thing.class_name
    stands = rest.quat == UPRIGHT and (name in ROUND or name == "box")
    # The axis of what is turned; a handle beside it does not move it.
    at = (float(body_at[0]), float(body_at[1])) if stands else (x / 1000.0, y / 1000.0)
    centre = (*at, (low + high) / 2)
    return Truth(
        class_name=name,
        stands=stands,
        position_m=centre,
        size_m=(length / 1000.0, width / 1000.0, high - low),
        yaw_rad=math.radians(yaw),
        range_m=float(np.linalg.norm(np.array(centre) - pose[:3, 3])),
    )


def _points(model: Any, prop: Prop, at: Array, turn: Array) -> Array:
    """Return points of the thing's surface, enough to bound it."""
    clouds = [_geom_points(model, geom) for geom in prop.geoms]
    points: Array = np.vstack(clouds) @ turn.T + at
    return points


def _geom_points(model: Any, geom: int) -> Array:
    """Return points that bound a geom, in its body's frame."""
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH.value:
        mesh = int(model.geom_dataid[geom])
        first = int(model.mesh_vertadr[mesh])
        local = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])].astype(np.float64)
    else:
        local = _solid_points(kind, size)
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    points: Array = local @ turn.reshape(3, 3).T + model.geom_pos[geom]
    return points


def _solid_points(kind: int, size: Array) -> Array:
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    if kind == mujoco.mjtGeom.mjGEOM_BOX.value:
        return signs * size
    angle = np.linspace(0.0, 2 * math.pi, 48, endpoint=False)
    ring = np.column_stack((np.cos(angle), np.sin(angle)))
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER.value:
        rims = [np.column_stack((size[0] * ring, np.full(48, z * size[1]))) for z in (-1.0, 1.0)]
        return np.vstack(rims)
    latitude = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 13)
    ball = np.vstack(
        [np.column_stack((math.cos(a) * ring, np.full(48, math.sin(a)))) for a in latitude]
    )
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE.value:
        shift = np.array([0.0, 0.0, size[1]])
        return np.vstack((size[0] * ball + shift, size[0] * ball - shift))
    radii = np.full(3, size[0]) if kind == mujoco.mjtGeom.mjGEOM_SPHERE.value else size
    points: Array = ball * radii
    return points
