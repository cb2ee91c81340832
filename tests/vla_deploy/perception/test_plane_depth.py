"""A colour camera over a table: depth from the table's plane and known sizes, in the twin's table.

The images are rendered without physics; the node gets them as a webcam's stream in the twin.
"""

import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import can
import cv2
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from platforms import load_profile
from sim_twin.physics.load import load_model
from sim_twin.pictures.head_camera import HeadCamera
from sim_twin.ports.lines import MemoryLine
from sim_twin.sensors.camera import CameraDevice
from sim_twin.worlds.placement import draw_poses
from vla_deploy.ipc import SharedSpace
from vla_deploy.perception.geometry.body_mask import BodyMask
from vla_deploy.perception.geometry.cloud import PosedImage, make_cloud
from vla_deploy.perception.geometry.geometry_grid import geometry_grid
from vla_deploy.perception.geometry.plane_depth import PlaneDepth, TableImage
from vla_deploy.perception.geometry.supports import find_supports
from vla_deploy.perception.images.detection import Detection, detect
from vla_deploy.perception.images.known_view import with_known
from vla_deploy.perception.node import PerceptionNode
from vla_deploy.robots import load_robot
from vla_deploy.robots.floor_pose import Pose2D
from vla_deploy.robots.kinematics.model import RobotModel
from vla_deploy.robots.known_things import KnownThing
from vla_deploy.robots.loader import OVERRIDES_FILE, ROBOTS_DIR
from vla_deploy.runtime.node import NodeContext

Rgb = NDArray[np.uint8]
TABLE_M = 0.75
HIDDEN_GROUP = 5
STEP_NS = 20_000_000
OVERRIDES = """
[camera]
model = "V4L2"

[[things]]
class = "block"
size_m = [0.025, 0.025, 0.025]

[[things]]
class = "bowl"
size_m = [0.10, 0.10, 0.041]
"""
BLOCK = KnownThing(class_name="block", size_m=(0.025, 0.025, 0.025))
BOWL = KnownThing(class_name="bowl", size_m=(0.10, 0.10, 0.041))
POST = KnownThing(class_name="bottle", size_m=(0.025, 0.025, 0.6))
TILE = KnownThing(class_name="tile", size_m=(0.0255, 0.0255, 0.0125))
THINGS = {"red_block": ("block", "red"), "blue_block": ("block", "blue"), "bowl": ("bowl", "white")}


class StillTable:
    """Pose arm, camera and things at will, then look."""

    def __init__(self, folder: Path) -> None:
        self.robot = load_robot(folder)
        self.kinematics = RobotModel(self.robot)
        self.model = load_model(self.robot, "table")
        self.data = mujoco.MjData(self.model)
        self.camera = HeadCamera(self.model, self.data, self.robot.camera, seed=0)
        self.mask = BodyMask(self.kinematics)
        self.stand("aside")

    def stand(self, pose: str) -> None:
        self.joints = np.array([self.robot.poses[pose][name] for name in self.robot.joint_names])
        for name, value in zip(self.robot.joint_names, self.joints, strict=True):
            self.data.qpos[self.model.joint(name).qposadr[0]] = value

    def scatter(self, seed: int) -> None:
        for name, pose in draw_poses("table", seed).items():
            self.put(name, pose.position_m, pose.yaw_rad)

    def put(self, name: str, position_m: tuple[float, float, float], yaw_rad: float = 0.0) -> None:
        start = self.model.jnt_qposadr[self.model.body(name).jntadr[0]]
        turn = (math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2))
        self.data.qpos[start : start + 7] = (*position_m, *turn)

    def truth(self, name: str) -> NDArray[np.float64]:
        return np.array(self.data.body(name).xpos) - (0.0, 0.0, TABLE_M)

    def image(
        self,
        eye_m: tuple[float, float, float] | None = None,
        spoil: Callable[[Rgb], Rgb] = lambda rgb: rgb,
    ) -> PosedImage:
        """Return what the camera sees from its stand; from another place it sees no robot."""
        mujoco.mj_forward(self.model, self.data)
        pose = self.kinematics.camera_pose(self.joints)
        if eye_m is not None:
            pose = looking_at((0.2, 0.0, 0.0), eye_m)
        # The camera's stand sleeps: a step does not put it back.
        number = self.model.camera("table_camera").id
        self.data.cam_xpos[number] = pose[:3, 3] + np.array((0.0, 0.0, TABLE_M))
        self.data.cam_xmat[number] = (pose[:3, :3] @ np.diag((1.0, -1.0, -1.0))).ravel()
        grid = geometry_grid(self.robot.camera.pinhole)
        rgb = grid.colours(spoil(self._rendered(with_robot=eye_m is None)))
        body = self.mask.mask(self.joints, grid.camera)
        return PosedImage(
            rgb=rgb,
            depth_m=np.zeros(rgb.shape[:2], np.float32),
            camera=grid.camera,
            base_from_camera=pose,
            body=body if eye_m is None else np.zeros_like(body),
            base=Pose2D(0.0, 0.0, 0.0),
            stamp_ns=0,
        )

    def _rendered(self, *, with_robot: bool) -> Rgb:
        model, groups = self.model, self.model.geom_group.copy()
        if not with_robot:
            own = model.body_rootid[model.geom_bodyid] == model.body("base").id
            model.geom_group[own] = HIDDEN_GROUP
        rgb, _ = self.camera.render()
        model.geom_group[:] = groups
        return rgb

    def seen(self, image: PosedImage, *things: KnownThing) -> TableImage:
        known = things or self.robot.things
        return PlaneDepth(self.robot.reach, known).of(image)


def looking_at(
    point_m: tuple[float, float, float], eye_m: tuple[float, float, float]
) -> NDArray[np.float64]:
    """Return an optical frame: x right, y down, z towards a point."""
    ahead = np.array(point_m) - eye_m
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack((right, np.cross(ahead, right), ahead))
    pose[:3, 3] = eye_m
    return pose


def found_in(seen: TableImage) -> list[Detection]:
    assert not seen.faults
    image = seen.image
    cloud = make_cloud(image.rgb, image.depth_m, image.camera, image.base_from_camera, image.body)
    return detect(cloud, find_supports(cloud, (), None), with_known(None, seen.sights))


def names_in(seen: TableImage) -> list[tuple[str, str]]:
    return sorted((one.class_name, one.colour) for one in found_in(seen))


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Iterator[StillTable]:
    folder = Path(
        shutil.copytree(ROBOTS_DIR / "so101", tmp_path_factory.mktemp("robot") / "so101_usb")
    )
    (folder / OVERRIDES_FILE).write_text(OVERRIDES)
    still = StillTable(folder)
    yield still
    still.camera.close()


@pytest.fixture(autouse=True)
def first_scene(table: StillTable) -> None:
    table.stand("aside")
    table.scatter(0)


@pytest.mark.parametrize("eye_m", [None, (0.55, 0.25, 0.45)], ids=["above", "beside"])
def test_things_of_known_size_stand_where_they_are(
    table: StillTable, eye_m: tuple[float, float, float] | None
) -> None:
    for seed in (0, 4):
        table.scatter(seed)
        found = {
            (one.class_name, one.colour): one for one in found_in(table.seen(table.image(eye_m)))
        }
        for body, name in THINGS.items():
            off = np.array(found[name].position_m[:2]) - table.truth(body)[:2]
            assert np.linalg.norm(off) < 0.0025
        sizes = np.array([found[("block", "red")].size_m, found[("bowl", "white")].size_m])
        assert sizes == pytest.approx(np.array([BLOCK.size_m, BOWL.size_m]), abs=0.003)


def webcam_like(rgb: Rgb) -> Rgb:
    """Darken corners and one side, add noise, and compress as a webcam does."""
    across, down = np.meshgrid(*(np.linspace(-1.0, 1.0, size) for size in rgb.shape[1::-1]))
    light = (1.0 - 0.15 * (across**2 + down**2)) * np.where(across > 0.3, 0.8, 1.0)
    noise = np.random.default_rng(0).normal(0.0, 6.0, rgb.shape)
    spoiled = (rgb * light[..., None] + noise).clip(0, 255).astype(np.uint8)
    _, packed = cv2.imencode(".jpg", spoiled, [cv2.IMWRITE_JPEG_QUALITY, 80])
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)


def test_noise_shade_and_compression_change_little(table: StillTable) -> None:
    for seed in (0, 2, 9):
        table.scatter(seed)
        found = found_in(table.seen(table.image(spoil=webcam_like)))
        for body, (class_name, _) in THINGS.items():
            off = min(
                float(np.linalg.norm(np.array(one.position_m[:2]) - table.truth(body)[:2]))
                for one in found
                if one.class_name == class_name
            )
            assert off < 0.0025
        assert len(found) == 3


@pytest.mark.parametrize(
    ("things", "expected"),
    [
        ((BOWL,), [("bowl", "white"), ("object", "blue"), ("object", "red")]),
        ((BLOCK,), [("block", "blue"), ("block", "red"), ("object", "white")]),
        # Higher than the camera: it is none of what is seen.
        ((BLOCK, POST), [("block", "blue"), ("block", "red"), ("object", "white")]),
        # Seen from above, a lower and a little wider tile looks the same; aside, its side is lower.
        ((BLOCK, TILE), [("block", "red"), ("object", "blue"), ("object", "white")]),
    ],
    ids=["no block", "no bowl", "too high", "two heights fit"],
)
def test_what_no_size_explains_is_an_object(
    table: StillTable, things: tuple[KnownThing, ...], expected: list[tuple[str, str]]
) -> None:
    assert names_in(table.seen(table.image(), *things)) == expected


def test_blocks_that_touch_are_told_apart_by_their_colours(table: StillTable) -> None:
    table.put("red_block", (0.2, -0.06, TABLE_M + 0.0125))
    table.put("blue_block", (0.2, -0.0345, TABLE_M + 0.0125))
    seen = names_in(table.seen(table.image()))
    assert seen == [("block", "blue"), ("block", "red"), ("bowl", "white")]


def test_of_what_the_arm_hides_in_part_nothing_is_said(table: StillTable) -> None:
    image = table.image()
    x_m, y_m, _ = table.truth("red_block")
    (red,) = [one for one in found_in(table.seen(image)) if one.colour == "red"]
    left, top, _, bottom = red.box_px
    image.body[top - 20 : bottom + 20, left - 40 : left + 6] = True
    seen = table.seen(image)
    assert ("block", "red") not in names_in(seen)
    assert not seen.image.depth_m[top + 5 : bottom - 5, left + 8].any(), (x_m, y_m)


def test_a_container_hides_what_is_in_it_and_stays_a_container(table: StillTable) -> None:
    x_m, y_m, _ = draw_poses("table", 0)["bowl"].position_m
    table.put("red_block", (x_m, y_m, TABLE_M + 0.0165))
    seen = table.seen(table.image())
    assert names_in(seen) == [("block", "blue"), ("bowl", "white")]
    ((left, top, right, bottom),) = [s.box_px for s in seen.sights if s.class_name == "bowl"]
    middle = seen.image.depth_m[(top + bottom) // 2, (left + right) // 2]
    assert middle == 0.0


def covered(rgb: Rgb) -> Rgb:
    """Cover the table with tiles of many colours."""
    random = np.random.default_rng(0)
    tiles = random.integers(40, 255, (12, 16, 3)).astype(np.uint8)
    rows, columns = (np.arange(size) * 12 // size for size in rgb.shape[:2])
    spoiled = tiles[rows[:, None], columns]
    spoiled[::5] = rgb[::5]
    return spoiled


@pytest.mark.parametrize(
    ("spoil", "fault"),
    [
        (lambda image: replace(image, rgb=covered(image.rgb)), "table covered"),
        (
            lambda image: replace(
                image, base_from_camera=image.base_from_camera @ np.diag((1.0, -1.0, -1.0, 1.0))
            ),
            "does not look at the table: 0.00",
        ),
        (
            lambda image: replace(
                image, base_from_camera=looking_at((2.0, 0.0, 0.3), (0.2, 0, 0.5))
            ),
            "does not look at the table",
        ),
    ],
    ids=["covered", "upwards", "away"],
)
def test_an_image_without_the_table_has_no_depth(
    table: StillTable, spoil: Callable[[PosedImage], PosedImage], fault: str
) -> None:
    seen = table.seen(spoil(table.image()))
    assert fault in seen.faults[0]
    assert not seen.image.depth_m.any()


class WebcamRig:
    """Step perception's node with the camera's stream and control's joints."""

    def __init__(self, table: StillTable, run_dir: Path) -> None:
        self.now = 1_000_000_000
        self.spoil: Callable[[Rgb], Rgb] = lambda rgb: rgb
        self._table = table
        robot = table.robot
        self._camera = CameraDevice(
            self._render, robot.camera.pinhole, has_depth=robot.camera.has_depth
        )
        self._line = MemoryLine(self._camera, self)
        self.space = SharedSpace(run_dir / "ipc", self)
        self._joint_state = self.space.cell_writer("joint_state")
        context = NodeContext(
            run_dir=run_dir, robot="so101", profile="desktop", devices_dir=None, clock=self
        )
        self.node = PerceptionNode(context, robot, load_profile("desktop"), self)
        self.node.start()

    def now_ns(self) -> int:
        return self.now

    def sleep_until(self, deadline_ns: int) -> None:
        raise AssertionError("perception never sleeps")

    def video(self, name: str) -> MemoryLine:
        return self._line

    def serial(self, name: str) -> MemoryLine:
        raise AssertionError(f"no {name} is on a serial line")

    stream = input_events = serial

    def can(self, name: str) -> can.BusABC:
        raise AssertionError(f"no {name} is on a CAN bus")

    def gpio_contact(self, name: str, offset: int) -> Any:
        raise AssertionError(f"no {name} is on GPIO")

    def run_for(self, seconds: float) -> dict[str, Any]:
        """Return the scene then."""
        end_ns = self.now + round(seconds * 1e9)
        joints = self._table.joints
        zeros = np.zeros(len(joints))
        while self.now < end_ns:
            self.now += STEP_NS
            self._joint_state.put(
                joint_count=len(joints),
                position=joints,
                velocity=zeros,
                setpoint=joints,
                effort_ratio=zeros,
                age_s=zeros,
                error=zeros,
                torque_enabled=np.ones(len(joints)),
            )
            self._camera.step(self.now)
            self.node.step()
        sample = self.space.cell_reader("scene").latest()
        assert sample is not None
        return sample.document()

    def _render(self) -> tuple[Rgb, NDArray[np.float32]]:
        rgb, depth_m = self._table.camera.render()
        return self.spoil(rgb), depth_m


@pytest.fixture
def rig(table: StillTable, tmp_path: Path) -> Iterator[WebcamRig]:
    table.image()
    rig = WebcamRig(table, tmp_path)
    yield rig
    rig.node.stop()


def test_a_webcam_shows_a_scene_until_its_images_are_bad(rig: WebcamRig) -> None:
    scene = rig.run_for(1.2)
    assert sorted((one["class"], one["colour"]) for one in scene["objects"]) == sorted(
        THINGS.values()
    )
    assert scene["image"] == {"use": "all", "faults": [], "refused": 0}
    for spoil, fault in (
        (covered, "table covered"),
        (lambda rgb: (rgb // 12).astype(np.uint8), "dark"),
    ):
        rig.spoil = spoil
        later = rig.run_for(0.8)
        assert later["image"]["faults"][0].startswith(fault)
        assert rig.now - later["stamp_ns"] > 600_000_000
